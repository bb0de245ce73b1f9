"""Make tasks from [position], [pointing], [posture], [limits], [damping] and [[tasks]]."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np

from hierarchy import HierarchyError, Robot, State, Task
from hierarchy.errors import UnknownNameError
from hierarchy.paths import Path, Shifted, Still
from hierarchy.problem import Array
from hierarchy.tasks import (
    Along,
    CentreOfMass,
    CumulatedRepulsion,
    DangerBounds,
    FrameLog,
    JointDamping,
    JointLimits,
    Pointing,
    Pose,
    Position,
    Posture,
    TorqueLimits,
)
from scenarios.cell.paths import make_path
from scenarios.cell.robot import sensed_points
from scenarios.cell.special import special_task
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceSection
from scenarios.config.control import ControlSection
from scenarios.config.listed import (
    AnyTask,
    ListedCentreOfMass,
    ListedFrame,
    ListedPointing,
    ListedPose,
    ListedPosition,
    ListedPosture,
)
from scenarios.config.tasks import (
    AlongSection,
    LimitsSection,
    PointingSection,
    PositionSection,
    PositionTask,
    PostureSection,
)

_OF_A_FRAME = (PositionSection, PointingSection, PostureSection, ListedPosition, ListedPose,
               ListedFrame, ListedCentreOfMass, ListedPointing, ListedPosture)


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


def position_of(scenario: Scenario, start: State) -> Position | None:
    """Return the task of [position], or None."""
    if scenario.position is None:
        return None
    task = task_of(scenario.position, start)
    assert isinstance(task, Position)
    avoidance = scenario.avoidance
    if isinstance(avoidance, AvoidanceSection):
        return replace(task, repulsion_within=avoidance.end_effector)
    return task


def pointing_of(scenario: Scenario, start: State) -> Pointing | None:
    """Return the task of [pointing], or None."""
    if scenario.pointing is None:
        return None
    task = task_of(scenario.pointing, start)
    assert isinstance(task, Pointing)
    # Algorithm 1 adds the cone's surface to the stack while it is violated: an equality.
    return replace(task, kind="equality") if scenario.control.stack == "switched" else task


def posture_of(scenario: Scenario, start: State, role: str) -> Task | None:
    """Return the task of [posture] if it has this role ("task" or "null-space"), or None."""
    section = scenario.posture
    return task_of(section, start) if section and section.role == role else None


def reference_of(scenario: Scenario, start: State) -> Task | None:
    """Return the null-space task: [damping], or [posture] in that role; or None.

    The body's repulsion is added to it where that is its place.
    """
    base = (posture_of(scenario, start, "null-space") if scenario.damping is None
            else JointDamping(start.n, scenario.damping.value, scenario.damping.weight))
    avoidance = scenario.avoidance
    if not isinstance(avoidance, AvoidanceSection) or avoidance.place == "stack":
        return base
    points = start.robot.control_points
    return CumulatedRepulsion(start.n, points, avoidance.far, base) if points else base


def task_of(section: AnyTask, start: State) -> Task:
    """Make a task; values that the section omits are those of the start.

    Raises ScenarioError, naming the task, for an unknown frame or joint.
    """
    try:
        return _task(section, start)
    except UnknownNameError as error:
        raise ScenarioError(f"task {section.title!r}: {error}") from error


def _task(section: AnyTask, start: State) -> Task:
    if not isinstance(section, _OF_A_FRAME):
        return special_task(section, start)
    robot = start.robot
    gains = (section.stiffness, section.damping, section.gain)
    name = section.title
    if isinstance(section, PostureSection | ListedPosture):
        return Posture(_target(section, start), *gains, name=name, robot=robot)
    if isinstance(section, ListedCentreOfMass):
        anywhere = CentreOfMass(robot, Still((0.0, 0.0, 0.0)))
        return CentreOfMass(robot, _path(section, anywhere.position(start)),
                            tuple("xyz".index(axis) for axis in section.axes), *gains, name=name)
    frame = robot.frame(section.frame or robot.end_effector)
    if isinstance(section, PointingSection | ListedPointing):
        half_angle = radians(section.alpha_d)
        return Pointing(frame, section.axis, half_angle, section.rows, *gains, name=name)
    path = _path(section, start.position(frame))
    if isinstance(section, ListedPose | ListedFrame):
        rotation = start.rotation(frame) if section.rotation is None else section.rotation
        kind = Pose if isinstance(section, ListedPose) else FrameLog
        return kind(frame, path, rotation, *gains, name=name)
    task = Position(frame, path, *gains, name=name)
    axes = getattr(section, "axes", "xyz")
    return task if axes == "xyz" else Along(
        task, np.eye(3)[["xyz".index(axis) for axis in axes]].tolist(), name)


def _path(section: PositionTask | AlongSection, here: Array) -> Path:
    offset = np.array(section.offset)
    if section.path is None:
        return Still((here + offset).tolist())
    path, shift = make_path(section.path), offset + here * section.from_start
    return Shifted(path, shift.tolist()) if shift.any() else path


def _target(section: PostureSection | ListedPosture, start: State) -> Array:
    robot = start.robot
    try:
        q = start.q if section.target is None else robot.configuration(section.target)
        return robot.configuration(section.joints, q)
    except UnknownNameError:
        raise
    except HierarchyError as error:
        raise ScenarioError(f"task {section.title!r}: {error}") from error
