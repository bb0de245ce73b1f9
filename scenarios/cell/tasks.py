"""Make tasks from [position], [pointing], [posture], [limits], [damping] and [[tasks]]."""

from __future__ import annotations

from math import radians

import numpy as np

from hierarchy import HierarchyError, Robot, State, Task
from hierarchy.errors import UnknownNameError
from hierarchy.paths import Path, Shifted, Still
from hierarchy.problem import Array
from hierarchy.tasks import (
    CentreOfMass,
    DangerBounds,
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
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceSection
from scenarios.config.sections import (
    ListedCentreOfMass,
    ListedPointing,
    ListedPose,
    ListedPosition,
    ListedPosture,
    ListedTask,
)


def limits_of(scenario: Scenario, robot: Robot) -> tuple[JointLimits | None, list[Task]]:
    """Return the joint limits, and the tasks at the top of the stack."""
    section = scenario.limits
    if section is None:
        return None, []
    try:
        limits = JointLimits(robot, section.acceleration, scenario.control.period, section.margin)
        box = limits if section.danger_reach is None else DangerBounds(
            limits, sensed_points(robot), section.danger_reach, name=limits.name)
        if not scenario.limits_in_stack:
            return limits, []
        torque = [] if section.torque is None else [TorqueLimits(robot, section.torque)]
    except HierarchyError as error:
        raise ScenarioError(f"limits: {error}") from error
    return limits, [box, *torque]


def position_of(scenario: Scenario, robot: Robot) -> Position | None:
    """Return the task of [position], or None."""
    section = scenario.position
    if section is None:
        return None
    avoidance = scenario.avoidance
    within = avoidance.end_effector if isinstance(avoidance, AvoidanceSection) else -1.0
    path = make_path(section.path)
    return Position(robot.frame(robot.end_effector),
                    Shifted(path, section.offset) if any(section.offset) else path,
                    section.stiffness, section.damping, section.gain, repulsion_within=within)


def pointing_of(scenario: Scenario, robot: Robot) -> Pointing | None:
    """Return the task of [pointing], or None."""
    section = scenario.pointing
    if section is None:
        return None
    # Algorithm 1 adds the cone's surface to the stack while it is violated: an equality.
    kind = section.kind if scenario.control.stack == "hierarchical" else "equality"
    return Pointing(robot.frame(robot.end_effector), section.axis, radians(section.alpha_d),
                    kind, section.stiffness, section.damping, section.gain)


def posture_of(scenario: Scenario, robot: Robot, role: str) -> Posture | None:
    """Return the task of [posture] if it has this role ("task" or "null-space"), or None."""
    section = scenario.posture
    if section is None or section.role != role:
        return None
    joints = robot.n - robot.actuated
    if len(section.target) != joints:
        raise ScenarioError(f"posture.target has {len(section.target)} entries, robot "
                            f"{robot.name!r} has {joints} joints")
    return Posture(section.target, section.stiffness, section.damping, section.gain)


def reference_of(scenario: Scenario, robot: Robot) -> Task | None:
    """Return the null-space task: [damping], or [posture] in that role; or None."""
    if scenario.damping is not None:
        return JointDamping(robot.n, scenario.damping.value, scenario.damping.weight)
    return posture_of(scenario, robot, "null-space")


def listed_tasks(sections: tuple[ListedTask, ...], start: State) -> list[Task]:
    """Make the tasks of `[[tasks]]`; values that they omit are those of the start."""
    tasks = []
    for section in sections:
        try:
            tasks.append(_task(section, start))
        except UnknownNameError as error:
            raise ScenarioError(f"task {section.title!r}: {error}") from error
    return tasks


def _task(section: ListedTask, start: State) -> Task:
    robot = start.robot
    gains = {"stiffness": section.stiffness, "damping": section.damping, "gain": section.gain,
             "name": section.title}
    if isinstance(section, ListedPosture):
        return Posture(_target(section, start), **gains)  # type: ignore[arg-type]
    if isinstance(section, ListedCentreOfMass):
        anywhere = CentreOfMass(robot, Still((0.0, 0.0, 0.0)))
        path = _path(section, anywhere.position(start))
        return CentreOfMass(robot, path, tuple("xyz".index(axis) for axis in section.axes),
                            **gains)  # type: ignore[arg-type]
    frame = robot.frame(section.frame)
    if isinstance(section, ListedPointing):
        return Pointing(frame, section.axis, radians(section.alpha_d), section.rows,
                        **gains)  # type: ignore[arg-type]
    path = _path(section, start.position(frame))
    if isinstance(section, ListedPose):
        rotation = start.rotation(frame) if section.rotation is None else section.rotation
        return Pose(frame, path, rotation, **gains)  # type: ignore[arg-type]
    return Position(frame, path, **gains)  # type: ignore[arg-type]


def _path(section: ListedPosition | ListedPose | ListedCentreOfMass, here: Array) -> Path:
    if section.path is None:
        return Still(here.tolist())
    path = make_path(section.path)
    return Shifted(path, here.tolist()) if section.from_start else path


def _target(section: ListedPosture, start: State) -> tuple[float, ...]:
    robot = start.robot
    joints = robot.nq - (7 if robot.base == "floating" else 0)
    target = start.q[robot.nq - joints:].copy() if section.target is None else np.array(
        section.target)
    if len(target) != joints:
        raise ScenarioError(f"task {section.title!r}: target has {len(target)} entries, robot "
                            f"{robot.name!r} has {joints} joints")
    for name, value in section.joints.items():
        target[robot.coordinate(name) - (robot.nq - joints)] = value
    return tuple(float(value) for value in target)
