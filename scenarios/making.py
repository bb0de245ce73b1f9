"""From sections of a scenario file to a robot, its start, its paths and its listed tasks."""

from __future__ import annotations

from math import radians

import numpy as np

from hierarchy import HierarchyError, Robot, State, Task
from hierarchy.avoidance import Capsule
from hierarchy.avoidance.self_collision import measure_capsules, pack_capsules, pairs_of_tree
from hierarchy.errors import UnknownNameError
from hierarchy.paths import Ellipse, Path, Shifted, Still, Waypoints
from hierarchy.problem import Array
from hierarchy.tasks import CentreOfMass, Pointing, Pose, Position, Posture
from scenarios.config import ScenarioError
from scenarios.config.robot import RobotSection, StartSection
from scenarios.config.sections import (
    EllipseSection,
    ListedCentreOfMass,
    ListedPointing,
    ListedPose,
    ListedPosition,
    ListedPosture,
    ListedTask,
    PathSection,
    WaypointsSection,
)


def make_robot(section: RobotSection) -> Robot:
    """Make the robot of a scenario, with the points and the capsules the scenario asks for."""
    robot = Robot.load(section.model, section.end_effector, section.base, section.locked)
    if section.control_points is not None:
        robot.control_points = tuple(
            robot.control_point(point.joint, point.offset) if point.joint is not None
            else robot.control_point_of_frame(str(point.frame), point.offset)
            for point in section.control_points)
    if section.capsules is not None:
        base = 1 if robot.base == "floating" else 0
        robot.capsules = tuple(
            Capsule(f"{capsule.joint or 'base'} {i}",
                    base if capsule.joint is None else robot.joint(capsule.joint),
                    capsule.start, capsule.end, capsule.radius)
            for i, capsule in enumerate(section.capsules, 1))
    return robot


def separable_pairs(robot: Robot) -> list[tuple[int, int]]:
    """Return the pairs of capsules that can be kept apart, as indices.

    Neighbours of the tree share a joint and are none. Of capsules proposed for a file, which may
    stand out, no pair counts that overlaps in the robot's own posture.
    """
    pairs = pairs_of_tree(robot.capsules, robot.parents)
    if robot.table is not None or not pairs:
        return pairs
    distances = measure_capsules(robot.state(robot.rest).placements,
                                 *pack_capsules(robot.capsules), np.array(pairs))[:, 0]
    return [pair for pair, distance in zip(pairs, distances, strict=True) if distance > 0.0]


def make_path(section: PathSection) -> Path:
    """Make the path that a section describes."""
    if isinstance(section, EllipseSection):
        return Ellipse(section.centre, section.cosine, section.sine, section.rate)
    if isinstance(section, WaypointsSection):
        return Waypoints(section.times, section.points)
    return Still(section.position)


def start_state(robot: Robot, section: StartSection) -> State:
    """Return the state that a section describes, before the end effector is brought anywhere."""
    q = robot.rest.copy() if section.q is None else np.array(section.q)
    try:
        if q.shape == (robot.nq,):
            for name, value in section.joints.items():
                q[robot.coordinate(name)] = value
        return robot.state(q, section.v)
    except HierarchyError as error:
        raise ScenarioError(f"start: {error}") from error


def make_tasks(sections: tuple[ListedTask, ...], start: State) -> list[Task]:
    """Make the tasks of `[[tasks]]`; what they leave open is as at the start."""
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
        return Posture(_posture(section, start), **gains)  # type: ignore[arg-type]
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


def _posture(section: ListedPosture, start: State) -> tuple[float, ...]:
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
