"""Make tasks from [position], [pointing], [posture], [limits], [damping] and [[tasks]]."""

from __future__ import annotations

from dataclasses import replace

from hierarchy import HierarchyError, Robot, Task
from hierarchy.tasks import (
    CumulatedRepulsion,
    DangerBounds,
    JointDamping,
    JointLimits,
    Pointing,
    Position,
    TorqueLimits,
)
from scenarios.cell.robot import sensed_points
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceSection
from scenarios.config.control import ControlSection
from scenarios.config.references import References
from scenarios.config.tasks import (
    LimitsSection,
    Made,
)


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
            TorqueLimits(robot, section.torque)]  # with contact forces: scenarios.cell.forces
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
