"""Stack, order and resolver as the kind of `control.stack` has them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache
from itertools import product
from math import cos, inf, nan, radians
from typing import Protocol, final

from hierarchy import Stack, State, Task
from hierarchy.activation import Activation
from hierarchy.allocation import POINTING, POSITION, Allocation, allocate
from hierarchy.avoidance import Measurement, SurveillanceAreas
from hierarchy.contacts import Contacts
from hierarchy.tasks import Pointing, Separation
from hierarchy.tasks.self_separation import SelfSeparation
from hierarchy.tasks.together import TangentCone
from scenarios.cell.tasks import Tasks
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceSection
from solvers import Resolver
from solvers.resolvers.merged import Merged
from solvers.resolvers.set_based import SetBased
from solvers.resolvers.settled import Settled
from solvers.resolvers.smooth import Activated, Smooth


class Order(Protocol):
    """The selection and order of the tasks in the stack of a tick."""

    @property
    def possible(self) -> Iterable[tuple[str, ...]]:
        """Every possible order."""

    def __call__(self, seen: Measurement | None, cone_error: float) -> Allocation:
        """Return the order for measured distances and the cone error cos(alpha_d) - cos(alpha)."""


@final
class Hierarchical:
    """All tasks in every tick."""

    def __init__(self, names: Sequence[str]) -> None:
        self._allocation = Allocation(tuple(names), repulsion=False)
        self.possible = [self._allocation.order]

    def __call__(self, seen: Measurement | None, cone_error: float) -> Allocation:
        """Return the order, regardless of measurement and cone error."""
        return self._allocation


@final
class Switched:
    """Algorithm 1, below the tasks named `first`; without `areas` only the cone is switched.

    Without areas `tip` [m] is the distance within which the position has the repulsion of (30).
    With `always_point` the cone is an equality that is always in the stack.
    """

    def __init__(self, areas: SurveillanceAreas | None, always_point: bool,
                 first: Sequence[str] = (), position: bool = True, tip: float = -inf) -> None:
        self._areas, self._always_point, self._tip = areas, always_point, tip
        self._first, self._position = tuple(first), position
        self._behind_first = cache(self._put_behind)
        distances = (inf,) if areas is None else (areas.near, areas.far, inf)
        self.possible = {self._choose(body, end, cone).order for body, end, cone in product(
            distances, (0.0, inf), (1.0, nan))}

    def __call__(self, seen: Measurement | None, cone_error: float) -> Allocation:
        """Return the order for measured distances and the cone error cos(alpha_d) - cos(alpha)."""
        if seen is None:
            return self._choose(inf, inf, cone_error)
        return self._choose(seen.minimal_distance, seen.end_effector_distance, cone_error)

    def _choose(self, body: float, end: float, cone_error: float) -> Allocation:
        if self._areas is None:
            point = cone_error > 0.0 or self._always_point
            chosen = Allocation((POSITION,) * self._position + (POINTING,) * point,
                                repulsion=end <= self._tip)
        else:
            chosen = allocate(body, end, cone_error, self._areas, self._always_point)
        return self._behind_first(chosen) if self._first else chosen

    def _put_behind(self, chosen: Allocation) -> Allocation:
        return Allocation((*self._first, *chosen.order), chosen.repulsion)


def order_of(scenario: Scenario, areas: SurveillanceAreas | None, first: Sequence[Task],
             tasks: Sequence[Task]) -> Order:
    """Return the order of a scenario's tasks; those of `first` are always at the top."""
    if scenario.control.stack != "switched":
        return Hierarchical([task.name for task in tasks])
    always_point = bool(scenario.pointing and scenario.pointing.rows == "equality")
    section = scenario.avoidance
    tip = section.end_effector if isinstance(section, AvoidanceSection) else -inf
    return Switched(areas, always_point, [task.name for task in first],
                    scenario.position is not None, tip)


def stacked(scenario: Scenario, tasks: Tasks, state: State,
            contacts: Contacts | None) -> tuple[Stack, Order, Activation | None]:
    """Return the stack of the tasks, which order they have in a tick, and activations if any."""
    rows, activation = _rows(scenario, tasks.all, state)
    stack = Stack(rows, scenario.control.level, tasks.reference, contacts,
                  "mass" if scenario.control.metric == "mass" else None, tasks.give)
    return stack, order_of(scenario, tasks.areas, tasks.always, tasks.all), activation


def _rows(scenario: Scenario, tasks: Sequence[Task],
          state: State) -> tuple[Sequence[Task], Activation | None]:
    """Return the tasks with the rows of their stack, and their activations if it has any."""
    if scenario.control.stack == "set-based":
        return [TangentCone(task) if task.kind == "inequality" else task for task in tasks], None
    if scenario.control.stack != "smooth":
        return tasks, None
    widened = {task.name: _widened(task, scenario) for task in tasks if task.kind == "inequality"}
    found = [widened[task.name][0] if task.name in widened else task for task in tasks]
    buffers = {name: width for name, (_, width) in widened.items()}
    return found, Activation(state, found, buffers)


def stack_resolver(scenario: Scenario, stack: Stack, activation: Activation | None) -> Resolver:
    """Return the scenario's resolver, as its stack uses it; stack, activation as in a Cell.

    Raises ScenarioError if the stack has activations and the resolver does not take them.
    """
    resolver = scenario.make_resolver()
    if isinstance(resolver, Merged):
        scales = {name: stack[name].scale for name in stack.names}
        resolver = replace(resolver, scales=scales | dict(resolver.scales))
    if scenario.control.stack == "set-based":
        return SetBased(inner=resolver)
    if activation is None:
        return _settled(resolver, scenario, stack)
    if not isinstance(resolver, Smooth):
        raise ScenarioError('control.stack = "smooth" needs control.resolver = "smooth", got '
                            f'"{resolver.name}"')
    return Activated(inner=resolver, activation=activation)


def _settled(resolver: Resolver, scenario: Scenario, stack: Stack) -> Resolver:
    """Return a resolver that lets tasks out of reach come to rest, where x is a velocity."""
    control = scenario.control
    if control.level != "velocity" or control.damping == 0.0:
        return resolver
    curved = frozenset(name for name in stack.names if not stack[name].straight)
    return Settled(inner=resolver, period=control.period, softness=control.damping, curved=curved)


def _widened(task: Task, scenario: Scenario) -> tuple[Task, float]:
    """Return a task that aims at the far end of its buffer, and the buffer in its unit."""
    if isinstance(task, Pointing):
        sections = {section.title: section for section in (scenario.pointing, *scenario.tasks)
                    if section is not None}
        inner = task.half_angle - radians(getattr(sections[task.name], "buffer", None) or 0.0)
        return replace(task, half_angle=inner), cos(inner) - task.cos_alpha_d
    if not isinstance(task, Separation | SelfSeparation):
        raise ScenarioError(f"task {task.name!r}: control.stack = \"smooth\" has no buffer for it")
    width = float(getattr(scenario.avoidance, "buffer", None) or 0.0)
    barrier = replace(task.barrier, distance=task.barrier.distance + width)
    return replace(task, barrier=barrier), width
