"""Make the tasks of a scenario, in their order: from its sections, its list and its contacts."""

from __future__ import annotations

from dataclasses import replace
from math import inf
from typing import NamedTuple

from hierarchy import HierarchyError, Robot, Task
from hierarchy.avoidance import SurveillanceAreas
from hierarchy.contacts import Contacts
from hierarchy.task import check_period
from hierarchy.tasks import (
    BaseDynamics,
    CentreOfPressure,
    ContactMotion,
    CumulatedRepulsion,
    DangerBounds,
    Friction,
    JointDamping,
    JointLimits,
    Pointing,
    Position,
    Separation,
    Together,
    TorqueLimits,
)
from hierarchy.tasks.mechanism import above, model_rows
from scenarios.cell.avoidance import areas_of, avoidance_tasks
from scenarios.cell.robot import sensed_points
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceSection
from scenarios.config.control import ControlSection
from scenarios.config.references import References
from scenarios.config.tasks import LimitsSection, Made


class Tasks(NamedTuple):
    """The tasks of a scenario, see `Cell`; Algorithm 1 leaves `always` at the top."""

    all: list[Task]
    always: list[Task]
    position: Position | None
    pointing: Pointing | None
    limits: JointLimits | None
    listed: tuple[Task, ...]
    areas: SurveillanceAreas | None
    reference: Task | None
    give: dict[str, float]


def tasks_of(scenario: Scenario, at: References) -> Tasks:
    """Return the tasks of a scenario, most important first.

    Raises ScenarioError if it asks for nothing, or for what its robot cannot do.
    """
    _check_there_are_any(scenario, at.robot)
    areas, (limits, first) = areas_of(scenario), _first(scenario, at)
    position, pointing = position_of(scenario, at), pointing_of(scenario, at)
    listed = [task_of(section, at) for section in scenario.tasks if section.kind != "collision"]
    avoiding = avoidance_tasks(scenario, at)
    always = first if areas else [*first, *avoiding]  # repulsion is placed by Algorithm 1
    tasks = _in_order(scenario, [*first, *avoiding, *(
        task for task in (position, pointing, *listed, posture_of(scenario, at, "task")) if task)])
    if scenario.control.level == "velocity":
        for task in tasks:
            check_period(task, scenario.control.period)
    return Tasks(tasks, always, position, pointing, limits, tuple(listed), areas,
                 reference_of(scenario, at), _give(scenario))


def _first(scenario: Scenario, at: References) -> tuple[JointLimits | None, list[Task]]:
    """Return the joint limits, and all tasks at the top: mechanism, physics, limits."""
    limits, first = limits_of(scenario, at.robot)
    bounded = scenario.limits is not None and scenario.limits.place == "bounds"
    if at.contacts_or_none is not None:
        physics = _physics_of(scenario, at.contacts)
        first = [*first, *physics] if bounded else [*physics, *first]
    return limits, above(model_rows(at.robot, scenario.control.period), first,
                         not bounded and scenario.make_resolver().can_resolve("inequalities"))


def _check_there_are_any(scenario: Scenario, robot: Robot) -> None:
    """Raise a ScenarioError unless the scenario asks for something, or the robot's file does."""
    asked = scenario.position or scenario.pointing or scenario.avoidance or scenario.tasks
    if not (asked or robot.coupled or robot.loops):
        raise ScenarioError(f"scenario {scenario.name!r}: the stack is empty: give at least one of "
                            "[position], [pointing], [avoidance], [[tasks]]")


def limits_of(scenario: Scenario, robot: Robot) -> tuple[JointLimits | None, list[Task]]:
    """Return the joint limits, and the tasks at the top of the stack."""
    section = scenario.limits
    if section is None:
        return None, []
    try:
        limits = _joint_limits(section, scenario.control, robot)
        box = limits if section.danger_reach is None else DangerBounds(
            limits, sensed_points(robot), section.danger_reach, name=limits.name)
        if not scenario.limits_in_stack:
            return limits, []
        elsewhere = scenario.control.level == "torque" or section.place == "bounds"
        torque = [] if section.torque is None or elsewhere else [
            TorqueLimits(robot, section.torque)]  # with contact forces: `_physics_of`
    except HierarchyError as error:
        raise ScenarioError(f"limits: {error}") from error
    return limits, [box, *torque]


def _joint_limits(section: LimitsSection, control: ControlSection, robot: Robot) -> JointLimits:
    """Return the limits of the joints, and of a floating base unless only forces move it."""
    speed = section.base_speed
    if speed is None and robot.base == "floating" and control.level != "torque":
        speed = float(robot.velocity_limit[0]), float(robot.velocity_limit[3])
    return JointLimits(robot, section.acceleration, control.period, section.margin,
                       base_speed=speed, base_acceleration=section.base_acceleration)


def position_of(scenario: Scenario, at: References) -> Position | None:
    """Return the task of [position], or None."""
    if scenario.position is None:
        return None
    task = task_of(scenario.position, at)
    assert isinstance(task, Position)
    avoidance = scenario.avoidance
    if isinstance(avoidance, AvoidanceSection):
        return replace(task, repulsion_within=avoidance.end_effector)
    return task


def pointing_of(scenario: Scenario, at: References) -> Pointing | None:
    """Return the task of [pointing], or None."""
    if scenario.pointing is None:
        return None
    task = task_of(scenario.pointing, at)
    assert isinstance(task, Pointing)
    # Algorithm 1 adds the cone's surface to the stack while it is violated: an equality.
    return replace(task, kind="equality") if scenario.control.stack == "switched" else task


def posture_of(scenario: Scenario, at: References, role: str) -> Task | None:
    """Return the task of [posture] if it has this role ("task" or "null-space"), or None."""
    section = scenario.posture
    return task_of(section, at) if section and section.role == role else None


def reference_of(scenario: Scenario, at: References) -> Task | None:
    """Return the null-space task: [damping], or [posture] in that role; or None.

    The body's repulsion is added to it where that is its place.
    """
    base = (posture_of(scenario, at, "null-space") if scenario.damping is None
            else JointDamping(at.robot.n, scenario.damping.value, scenario.damping.weight))
    avoidance = scenario.avoidance
    if not isinstance(avoidance, AvoidanceSection) or avoidance.place == "stack":
        return base
    points = at.robot.control_points
    return CumulatedRepulsion(at.robot.n, points, avoidance.far, base) if points else base


def task_of(section: Made, at: References) -> Task:
    """Make a task; raises ScenarioError, naming it, where it does not fit the robot."""
    try:
        return section.make(at)
    except HierarchyError as error:
        raise ScenarioError(f"task {section.title!r}: {error}") from error


def _in_order(scenario: Scenario, tasks: list[Task]) -> list[Task]:
    """Move the separation from obstacles to the place of the listed task "collision"."""
    sections = [section.kind for section in scenario.tasks]
    if "collision" not in sections:
        return tasks
    apart = [task for task in tasks if isinstance(task, Separation)]
    rest = [task for task in tasks if not isinstance(task, Separation)]
    below = len(sections) - sections.index("collision") - 1  # of the list
    below += scenario.posture is not None and scenario.posture.role == "task"
    place = len(rest) - below
    return [*rest[:place], *apart, *rest[place:]]


def _give(scenario: Scenario) -> dict[str, float]:
    """Return how far tasks of the scenario may give, by name."""
    return {task.title: task.give for task in scenario.tasks if task.give}


def _physics_of(scenario: Scenario, contacts: Contacts) -> list[Task]:
    """Return the levels at the top of a stack at level "torque".

    "physics" has the equations of motion of a floating base and the contacts at rest, "limits" the
    torque limits and the forces that contacts can transmit. One that would be empty is left out.
    """
    try:
        motion = [ContactMotion(contacts, damping=scenario.forces.damping)] \
            if contacts.contacts else []
        dynamics = [BaseDynamics(contacts)] if contacts.robot.base == "floating" else []
        limits = _force_limits(scenario, contacts) if scenario.forces_in_stack else []
    except HierarchyError as error:
        raise ScenarioError(f"forces: {error}") from error
    return [Together(tasks, name) for tasks, name in (
        ([*dynamics, *motion], "physics"), (limits, "limits")) if tasks]


def _force_limits(scenario: Scenario, contacts: Contacts) -> list[Task]:
    limits, forces = scenario.limits, scenario.forces
    found: list[Task] = []
    if limits and (limits.torque or limits.torque_step):
        found.append(TorqueLimits(contacts.robot, limits.torque or 1.0, contacts=contacts,
                                  step=limits.torque_step or inf))
    if contacts.contacts:
        found.append(Friction(contacts, forces.faces, forces.least, forces.largest or inf))
    if forces.edge is not None:
        found.append(CentreOfPressure(contacts, forces.edge))
    return found
