"""Arms and humanoids at singular postures: straight limbs, aligned wrists, feet flat together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import final

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Still
from hierarchy.problem import Array, Hierarchy
from hierarchy.tasks import CentreOfMass, Pose

_FREE = 5.0     # [rad/s] bound of a joint that has none
_QUARTER = np.pi / 2.0
_TURNED = 3     # joints that are not straight, at most
_TRIALS = 50    # postures tried until one is singular
_SINGULAR = 1e-12  # smallest singular value of all tasks
_NEAR = (-7.0, -2.0)  # decimal logarithm of the distance from a singular posture [rad]


@final
@dataclass(frozen=True)
class Posed:
    """A robot by a name that `Robot.load` knows, and the frames that its tasks move.

    feet : frames whose pose is kept, the most important tasks. hands : frames that are moved.
    """

    model: str
    hands: tuple[str, ...]
    feet: tuple[str, ...] = ()


ROBOTS = {
    "singular-lwr": Posed("kuka_lwr", ("end_effector",)),
    "singular-dual-arm": Posed("dual_arm", ("left_hand", "right_hand")),
    "singular-humanoid": Posed("humanoid", ("right_hand", "left_hand"),
                               ("left_foot", "right_foot")),
    "singular-panda": Posed("example_robot_data:panda", ("panda_hand",)),
    "singular-romeo": Posed("example_robot_data:romeo", ("r_gripper", "l_gripper"),
                            ("l_ankle", "r_ankle"))}
"""Families by name; the last two need the extra `descriptions`."""


def posed(name: str, seed: int, count: int) -> list[Hierarchy]:
    """Return problems of a robot of ROBOTS at singular postures, reproducibly.

    A third is exactly singular, a third up to 0.01 rad from it, a third anywhere. Raises RobotError
    if the robot's package is not installed.
    """
    asked = ROBOTS[name]
    robot = Robot.load(asked.model)
    rng = np.random.default_rng([seed, list(ROBOTS).index(name), 4])
    return [_problem(asked, robot, rng, i % 3) for i in range(count)]


def _problem(asked: Posed, robot: Robot, rng: np.random.Generator, kind: int) -> Hierarchy:
    """Return velocity limits, feet, centre of mass, hands and a posture at one state."""
    joints = np.arange(robot.actuated, robot.n)
    limit = np.minimum(robot.velocity_limit[joints], _FREE)
    eye = np.eye(robot.n)[joints]
    levels: list[tuple[Array, ...]] = [(eye, -limit, limit)]
    tasks = _tasks(asked, robot, _posture(asked, robot, rng, kind))
    still = len(asked.feet)
    for k, J in enumerate(tasks):
        levels.append((J, (k >= still) * rng.uniform(-1.0, 1.0, len(J))))
    levels.append((eye, rng.uniform(-0.5, 0.5, len(joints))))
    return Hierarchy.from_levels(levels)


def _tasks(asked: Posed, robot: Robot, q: Array) -> list[Array]:
    """Return the rows of feet, centre of mass and hands, one array for each level."""
    state, still = State.at(robot, q), Still((0.0, 0.0, 0.0))
    poses = [Pose(robot.frame(name), still, np.eye(3)).jacobian(state)
             for name in (*asked.feet, *asked.hands)]
    if not asked.feet:
        return [part for J in poses for part in (J[:3], J[3:])]
    centre = CentreOfMass(robot, still, (0, 1)).jacobian(state)
    count = len(asked.feet)
    return [*poses[:count], centre, *(J[:3] for J in poses[count:])]


def _posture(asked: Posed, robot: Robot, rng: np.random.Generator, kind: int) -> Array:
    """Return q (nq,): straight but for a few right angles, exactly (0), nearly (1), or any (2)."""
    joints = np.arange(robot.actuated, robot.n)
    lower, upper = (np.clip(side[joints], -np.pi, np.pi) for side in robot.position_limits())
    if kind == 2:
        return _moved(robot, rng.uniform(lower, upper))
    angles = np.zeros(len(joints))
    for _ in range(_TRIALS):
        turned = rng.integers(len(joints), size=_TURNED)
        angles[:] = 0.0
        angles[turned] = rng.choice([-_QUARTER, 0.0, _QUARTER], _TURNED)
        angles = np.where((angles > lower) & (angles < upper), angles, 0.0)
        rows = np.vstack(_tasks(asked, robot, _moved(robot, angles)))
        if np.linalg.svd(rows, compute_uv=False)[-1] < _SINGULAR:
            break
    if kind == 1:
        angles = angles + 10.0**rng.uniform(*_NEAR) * rng.normal(size=len(joints))
    return _moved(robot, angles)


def _moved(robot: Robot, angles: Array) -> Array:
    """Return q (nq,) with these angles of the joints [rad]."""
    joints, step = np.arange(robot.actuated, robot.n), np.zeros(robot.n)
    step[joints] = angles - robot.rest[robot.coordinates[joints]]
    return robot.integrate(robot.rest, step)
