"""Build the parts of the control loop from a scenario."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hierarchy import Robot, Stack, State, Task
from hierarchy.activation import Activation
from hierarchy.avoidance import Obstacles, SurveillanceAreas
from hierarchy.contacts import Contacts
from hierarchy.jit import announce_compilation
from hierarchy.problem import Array
from hierarchy.tasks import JointLimits, Pointing, Position
from scenarios.cell.plants import Plant
from scenarios.cell.plants.plant import plant_of
from scenarios.cell.robot import placed
from scenarios.cell.sensors import Sensor
from scenarios.cell.sensors.sensor import sensor_of
from scenarios.cell.stacked import Order, stacked
from scenarios.cell.tasks import tasks_of
from scenarios.config import Scenario
from scenarios.config.references import References


@dataclass(frozen=True)
class Cell:
    """Everything the control loop needs: robot, start, tasks and sensor.

    `start` is q (nq,) and v (n,). `order` selects the tasks in the stack from the measurement and
    the cone error. `position`, `pointing`, `limits` are the tasks of these names or None, `listed`
    those of `[[tasks]]`; `areas` are those of Algorithm 1. `activation` is that of the stack's rows
    with control.stack = "smooth", else None.
    `contacts` are those at level "torque", else None.
    """

    scenario: Scenario
    robot: Robot
    start: tuple[Array, Array]
    state: State
    plant: Plant
    stack: Stack
    sensor: Sensor | None
    areas: SurveillanceAreas | None
    position: Position | None
    pointing: Pointing | None
    limits: JointLimits | None
    order: Order
    listed: tuple[Task, ...] = ()
    activation: Activation | None = None
    contacts: Contacts | None = None

    @property
    def velocity_limit(self) -> Array:
        """Largest velocities (n,) [rad/s or m/s], infinite for a base that has none in use."""
        limit = self.robot.velocity_limit.copy()
        limit[:self.robot.actuated] = np.inf
        if self.limits is not None:
            limit[self.limits.first:] = self.limits.limits.velocity
        return limit

    @property
    def torque_limit(self) -> Array:
        """Largest torques of the actuated joints [N m], the share of the limits in use."""
        limits = self.scenario.limits
        share = (limits and limits.torque) or 1.0
        return self.robot.effort_limit[self.robot.actuated:] * share


def build(scenario: Scenario, kept: Cell | None = None) -> Cell:
    """Build the parts; raises HierarchyError if the scenario does not fit its robot.

    `kept` is the cell of a scenario that differs only in its resolver or task settings: its robot,
    start, state, plant and obstacles are reused, and its sensor if the sensor settings are equal.
    """
    announce_compilation()
    at = References(State.at(kept.robot, *kept.start), kept.contacts) if kept else placed(scenario)
    sensor = sensor_of(scenario, at.start, (kept.scenario, kept.sensor) if kept else None)
    plant = kept.plant if kept else plant_of(
        scenario, at.start, sensor.obstacles if sensor else Obstacles(), at.contacts)
    tasks = tasks_of(scenario, at)
    differences = scenario.control.jacobian_derivative == "difference"
    state = kept.state if kept else State(at.robot,
                                          scenario.control.period if differences else None)
    stack, order, activation = stacked(scenario, tasks, state, at.contacts)
    return Cell(scenario, at.robot, (at.start.q, at.start.v), state, plant, stack, sensor,
                tasks.areas, tasks.position, tasks.pointing, tasks.limits, order, tasks.listed,
                activation, at.contacts)
