"""Build the parts of the control loop from a scenario, and the stack of `control.stack`."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import product
from math import cos, inf, radians

import numpy as np

from hierarchy import Robot, Stack, State, Task
from hierarchy.activation import Activation
from hierarchy.allocation import AVOIDANCE, POINTING, POSITION, Allocation, allocate
from hierarchy.avoidance import Measurement, Obstacles, SurveillanceAreas
from hierarchy.contacts import Contacts
from hierarchy.errors import check_name
from hierarchy.jit import announce_compilation
from hierarchy.problem import Array
from hierarchy.tasks import Pointing, Separation
from hierarchy.tasks.separation import SelfSeparation
from hierarchy.tasks.together import TangentCone
from scenarios.cell.plants import Plant
from scenarios.cell.plants.plant import Apart, plant_of
from scenarios.cell.robot import placed
from scenarios.cell.sensors import DepthSensor, Sensor
from scenarios.cell.sensors.camera import DepthCamera
from scenarios.cell.sensors.sensor import sensor_of
from scenarios.cell.tasks import Tasks, tasks_of
from scenarios.config import Scenario, ScenarioError
from scenarios.config.sections import naming
from scenarios.config.sections.avoidance import AvoidanceSection
from scenarios.config.sections.references import References
from solvers import Resolver
from solvers.reaching import settled
from solvers.resolvers.merged import Merged
from solvers.resolvers.set_based import SetBased
from solvers.resolvers.smooth import Activated, Smooth

Order = Callable[[Measurement | None, float], Allocation]
"""Selects and orders the tasks in the stack of a tick, by what is measured and the cone error."""


@dataclass(frozen=True)
class Cell:
    """Everything the control loop needs: robot, start, tasks, sensor and resolver.

    `start` is q (nq,) and v (n,). `order` selects the tasks in the stack from the measurement and
    the cone error cos(alpha_d) - cos(alpha), one of `orders`. `activation` is that of the stack's
    rows with control.stack = "smooth", else None. `contacts` are those at level "torque", else
    None.
    """

    scenario: Scenario
    robot: Robot
    start: tuple[Array, Array]
    state: State
    plant: Plant
    sensor: Sensor | None
    tasks: Tasks
    stack: Stack
    order: Order
    orders: Collection[tuple[str, ...]]
    resolver: Resolver
    activation: Activation | None = None
    contacts: Contacts | None = None

    @property
    def velocity_limit(self) -> Array:
        """Largest velocities (n,) [rad/s or m/s], infinite for a base that has none in use."""
        limit = self.robot.velocity_limit.copy()
        limit[:self.robot.actuated] = np.inf
        if self.tasks.limits is not None:
            limit[self.tasks.limits.first:] = self.tasks.limits.limits.velocity
        return limit

    @property
    def torque_limit(self) -> Array:
        """Largest torques of the actuated joints [N m], the share of the limits in use."""
        limits = self.scenario.limits
        share = (limits and limits.torque) or 1.0
        return self.robot.effort_limit[self.robot.actuated:] * share


def build(scenario: Scenario, kept: Cell | None = None) -> Cell:
    """Build the parts; raises HierarchyError if the scenario does not fit its robot or resolver.

    `kept` is the cell of a scenario that differs only in its resolver or task settings: its robot,
    start, state, plant and obstacles are reused, and its sensor if the sensor settings are equal.
    """
    announce_compilation()
    at = References(State.at(kept.robot, *kept.start), kept.contacts) if kept else placed(scenario)
    sensor = sensor_of(scenario, at.start, (kept.scenario, kept.sensor) if kept else None)
    plant = kept.plant if kept else plant_of(
        scenario, at.start, sensor.obstacles if sensor else Obstacles(), at.contacts)
    if isinstance(sensor, DepthSensor):
        if isinstance(sensor.source, DepthCamera):
            sensor.source.joints = (lambda: plant.true.q) if isinstance(plant, Apart) else None
        if kept and kept.scenario.sensor == scenario.sensor and isinstance(
                kept.sensor, DepthSensor):
            sensor.follow(kept.sensor)
    tasks = tasks_of(scenario, at)
    differences = scenario.control.jacobian_derivative == "difference"
    state = kept.state if kept else State(at.robot,
                                          scenario.control.period if differences else None)
    if kept is None:  # a first tick without a measurement continues from here
        state.move(0.0, plant.q, plant.v)
        state.commanded = plant.v.copy() if scenario.control.level == "velocity" else None
    rows, activation = _rows(scenario, tasks.all, state)
    stack = Stack(rows, scenario.control.level, tasks.reference, at.contacts,
                  "mass" if scenario.control.metric == "mass" else None, tasks.give)
    return Cell(scenario, at.robot, (at.start.q, at.start.v), state, plant, sensor, tasks, stack,
                *_order(scenario, tasks), _resolver(scenario, at.robot, stack, activation),
                activation, at.contacts)


def _order(scenario: Scenario, tasks: Tasks) -> tuple[Order, Collection[tuple[str, ...]]]:
    """Return all tasks in every tick, or Algorithm 1 below those that are always at the top.

    It allocates those of its tasks that there are. Without areas only the cone is switched, and the
    position has the repulsion of (30). A cone that is an equality is always in the stack.
    """
    names = tuple(task.name for task in tasks.all)
    if scenario.control.stack != "switched":
        fixed = Allocation(names, repulsion=False)
        return lambda seen, cone_error: fixed, [names]
    first = tuple(name for name in names if name not in (AVOIDANCE, POSITION, POINTING))
    always_point = bool(scenario.pointing and scenario.pointing.rows == "equality")
    section = scenario.avoidance
    tip = section.end_effector if isinstance(section, AvoidanceSection) else None
    areas = tasks.areas or SurveillanceAreas(0.0, 0.0, tip or 0.0)

    @cache
    def of_stack(chosen: Allocation) -> Allocation:
        return Allocation((*first, *(name for name in chosen.order if name in names)),
                          chosen.repulsion and tip is not None)

    def choose(seen: Measurement | None, cone_error: float) -> Allocation:
        body, end = (inf, inf) if seen is None else (
            seen.minimal_distance, seen.end_effector_distance)
        return of_stack(allocate(body, end, cone_error, areas, always_point))

    return choose, {of_stack(allocate(*at, areas, always_point)).order for at in product(
        (areas.near, areas.far, inf), (0.0, inf), (1.0, -1.0))}


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


def _resolver(scenario: Scenario, robot: Robot, stack: Stack,
              activation: Activation | None) -> Resolver:
    """Return the scenario's resolver, as its stack uses it.

    Raises ScenarioError if the stack has activations and the resolver does not take them, or lacks
    a level that has a scale.
    """
    resolver, control = scenario.make_resolver(), scenario.control
    if isinstance(resolver, Merged):
        scales, given = {name: stack[name].scale for name in stack.names}, dict(resolver.scales)
        with naming("control.options.scales"):
            for name in given:
                check_name("level", name, scales)
        resolver = replace(resolver, scales=scales | given)
    if control.stack == "set-based":
        return SetBased(inner=resolver)
    if activation is None and (control.level != "velocity" or control.damping == 0.0):
        return resolver
    if activation is None:  # where x is a velocity, tasks out of reach come to rest
        tasks = [stack[name].on(robot) for name in stack.names]
        return settled(robot, tasks, control.period, resolver, control.damping)
    if not isinstance(resolver, Smooth):
        raise ScenarioError('control.stack = "smooth" needs control.resolver = "smooth", got '
                            f'"{resolver.name}"')
    return Activated(inner=resolver, activation=activation)


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
