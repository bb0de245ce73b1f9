"""Stack, order and resolver as the kind of `control.stack` has them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import cos, radians

from hierarchy import Stack, State, Task
from hierarchy.activation import Activation
from hierarchy.contacts import Contacts
from hierarchy.tasks import Pointing, Separation
from hierarchy.tasks.self_separation import SelfSeparation
from hierarchy.tasks.tangent_cone import TangentCone
from scenarios.cell.order import Order, order_of
from scenarios.cell.tasks import Tasks
from scenarios.config import Scenario, ScenarioError
from solvers import Resolver
from solvers.resolvers.merged import Merged
from solvers.resolvers.set_based import SetBased
from solvers.resolvers.settled import Settled
from solvers.resolvers.smooth import Activated, Smooth


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
