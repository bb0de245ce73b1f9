"""Build the parts of the control loop from a scenario."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np

from hierarchy import Robot, Stack, State, Task
from hierarchy.activation import Activation
from hierarchy.avoidance import Obstacles, SurveillanceAreas
from hierarchy.contacts import Contacts
from hierarchy.jit import announce_compilation
from hierarchy.problem import Array
from hierarchy.tasks import JointLimits, Pointing, Position
from scenarios.cell.avoidance import separable_pairs
from scenarios.cell.contacts import check_contacts, contacts_of, standing_on
from scenarios.cell.order import Order, order_of
from scenarios.cell.plant import plant_of
from scenarios.cell.plants import Plant
from scenarios.cell.robot import make_robot, start_of
from scenarios.cell.sensor import sensor_of
from scenarios.cell.sensors import Sensor
from scenarios.cell.stacked import stacked
from scenarios.cell.tasks import check_there_are_tasks, tasks_of
from scenarios.config import Scenario
from scenarios.config.plant import TorqueSection
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
    if "TASK_HIERARCHY_WORKER" not in os.environ:  # what started this process has said it
        announce_compilation()
    control = scenario.control
    robot = kept.robot if kept else make_robot(scenario.robot)
    check_there_are_tasks(scenario, robot)
    sensor = _kept_sensor(scenario, kept) if kept else sensor_of(scenario, robot)
    contacts = kept.contacts if kept else contacts_of(scenario, robot)
    start = kept.start if kept else _start(scenario, robot, contacts)
    here = State.at(robot, *start)
    if kept:
        state, plant = kept.state, kept.plant
    else:
        differences = control.jacobian_derivative == "difference"
        state = State(robot, control.period if differences else None)
        if sensor is not None:
            sensor.check_start(here)
        if contacts is not None:
            check_contacts(scenario, contacts, here)
        plant = plant_of(scenario, robot, start, sensor.obstacles if sensor else Obstacles(),
                         contacts)
    tasks = tasks_of(scenario, References(here, contacts, separable_pairs))
    rows, activation = stacked(scenario, tasks.all, state)
    stack = Stack(rows, control.level, tasks.reference, contacts,
                  "mass" if control.metric == "mass" else None, tasks.give)
    return Cell(scenario, robot, start, state, plant, stack, sensor, tasks.areas, tasks.position,
                tasks.pointing, tasks.limits,
                order_of(scenario, tasks.areas, tasks.always, tasks.all), tasks.listed, activation,
                contacts)


def _start(scenario: Scenario, robot: Robot, contacts: Contacts | None) -> tuple[Array, Array]:
    q, v = start_of(robot, scenario.start)
    if scenario.start.on_floor and contacts is not None:
        floor = scenario.plant.height if isinstance(scenario.plant, TorqueSection) else 0.0
        q = standing_on(floor, contacts, q)
    return q, v


def _kept_sensor(scenario: Scenario, kept: Cell) -> Sensor | None:
    same = (scenario.avoidance, scenario.sensor, scenario.limits) == (
        kept.scenario.avoidance, kept.scenario.sensor, kept.scenario.limits)
    if same or kept.sensor is None:
        return kept.sensor
    return sensor_of(scenario, kept.robot, kept.sensor.obstacles)
