"""Make the robot and its start from [robot] and [start]."""

from __future__ import annotations

import numpy as np

from hierarchy import Robot, Stack, State
from hierarchy.avoidance import Capsule, ControlPoint
from hierarchy.paths import Still
from hierarchy.problem import Array
from hierarchy.tasks import Position
from hierarchy.tasks.mechanism import Mechanism, model_rows
from scenarios.cell.contacts import on_contacts
from scenarios.config import Scenario, ScenarioError
from scenarios.config.errors import naming
from scenarios.config.references import References
from scenarios.config.robot import RobotPointSection, RobotSection, StartSection
from solvers import make

_REACHED = 1e-6      # [m]
_REACH_STEPS = 500   # damped Newton steps; a reachable point takes about ten
_ON_LIMIT = 1e-9     # [rad or m] beyond a limit that is rounding
_LONGEST_STEP = 0.3  # [rad] of any joint
_CLOSED = 1e-3       # [m or rad] by which rounding in a file may leave a mechanism open


def placed(scenario: Scenario) -> References:
    """Return the robot of a scenario at its start, with its contacts.

    Raises ScenarioError if a section does not fit the robot, or contacts do not touch the floor.
    """
    robot = make_robot(scenario.robot)
    return References(*on_contacts(scenario, State.at(robot, *start_of(robot, scenario.start))))


def make_robot(section: RobotSection) -> Robot:
    """Make the robot of a scenario, with the control points and capsules of the section."""
    with naming("robot"):
        return _made(section)


def _made(section: RobotSection) -> Robot:
    robot = Robot.load(section.model, section.end_effector, section.base, section.locked,
                       section.root)
    if section.control_points is not None:
        robot.control_points = tuple(
            _point(robot, point, f"control_points.{i}")
            for i, point in enumerate(section.control_points))
    if section.capsules is not None:
        base = 1 if robot.base == "floating" else 0
        robot.capsules = tuple(
            Capsule(f"{capsule.joint or 'base'} {i}",
                    base if capsule.joint is None else robot.joint(capsule.joint),
                    capsule.start, capsule.end, capsule.radius)
            for i, capsule in enumerate(section.capsules, 1))
    return robot


def _point(robot: Robot, section: RobotPointSection, key: str) -> ControlPoint:
    with naming(key):
        if section.joint is not None:
            return robot.control_point(section.joint, section.offset)
        return robot.control_point_of_frame(str(section.frame), section.offset)


def sensed_points(robot: Robot) -> tuple[ControlPoint, ...]:
    """Return the points that a sensor measures: control points, then the end effector."""
    end = robot.frame(robot.end_effector)
    return (*robot.control_points, ControlPoint(end.name, end.joint, end.offset))


def start_of(robot: Robot, section: StartSection) -> tuple[Array, Array]:
    """Return q (nq,) and v (n,) of the start, with the end effector at the requested point.

    Raises ScenarioError if the section does not fit the robot, or the point is out of reach.
    """
    state = _state(robot, section)
    q, v = state.q.copy(), state.v.copy()
    if section.end_effector is not None:
        q = _reach(robot, q, np.array(section.end_effector))
    if not section.allow_outside_limits:
        _check_limits(robot, q)
    return q, v


def _check_limits(robot: Robot, q: Array) -> None:
    """Raise a ScenarioError that names the first joint beyond its limits, or far out of range."""
    for i in np.flatnonzero((q < robot.lower - _ON_LIMIT) | (q > robot.upper + _ON_LIMIT))[:1]:
        degrees = " Are these degrees?" if abs(q[i]) > 2.0 * np.pi else ""
        raise ScenarioError(
            f"start: {robot.coordinate_names[i]} at {q[i]:g} is beyond its limits, "
            f"{robot.lower[i]:.4g} to {robot.upper[i]:.4g} (rad or m).{degrees} "
            "start.allow_outside_limits = true allows it")


def _state(robot: Robot, section: StartSection) -> State:
    mechanism = Mechanism(robot)
    with naming("start"):
        q = (robot.configuration(section.q) if section.q is not None else robot.rest
             if section.keyframe is None else robot.start(section.keyframe))
        q = mechanism.closed(robot.configuration(section.joints, q), section.joints)
        state = State.at(robot, q, section.v)
    gap, where = mechanism.gap(q)
    if gap > _CLOSED:
        raise ScenarioError(f"start: {where}: the robot's mechanism stays open by {gap:.3g} (m or "
                            "rad) there; give other start.joints")
    return state


def _reach(robot: Robot, q: Array, point: Array) -> Array:
    """Return a posture near q with the end effector at a point [m]; raises ScenarioError."""
    frame, resolver = robot.frame(robot.end_effector), make("tpm", damping=0.05)
    mechanism = Mechanism(robot)
    stack = Stack([*model_rows(robot), Position(frame, Still(point.tolist()), gain=1.0)],
                  "velocity")
    nearest = np.inf
    for _ in range(_REACH_STEPS):
        state = State.at(robot, q)
        distance = float(np.linalg.norm(state.position(frame) - point))
        nearest = min(nearest, distance)
        if distance < _REACHED:
            return q
        step = resolver.solve(stack.hierarchy(state)).x
        step = step * min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
        q = mechanism.closed(robot.integrate(q, step))
    raise ScenarioError(f"start.end_effector {point.tolist()} m cannot be reached: robot "
                        f"{robot.name!r} came no nearer than {nearest:.3g} m")
