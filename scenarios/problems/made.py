"""Problems as the makers of other solvers test theirs, and robots at singular postures.

The former are written anew from what tests describe. of-soth: stack-of-tasks/soth,
unitTesting/RandomGenerator.cpp (randomProblem). of-lexls: jrl-umi3218/lexls,
interfaces/matlab-octave/tests/lexlse/define_problem.m. of-daqp: darnstrom/daqp,
interfaces/DAQP.jl/test/utils.jl (generate_test_QP), with the objective as the level below. Others
were recorded in the examples of packages that own the robot's model: `data/README.md`.

Singular postures of arms and humanoids: straight limbs, aligned wrists, feet flat together.
"""

from dataclasses import dataclass
from typing import final

import numpy as np

from hierarchy import Robot, State
from hierarchy.paths import Still
from hierarchy.problem import Array, Hierarchy
from hierarchy.tasks import CentreOfMass, Pose
from scenarios.problems.recorded import DATA
from solvers.problems.files import read

_UNKNOWNS = 4, 20       # of-soth, of-lexls: least and most
_CONDITION = 100.0      # of-daqp: of the Hessian
_BOUNDS, _ROWS, _ACTIVE, _SIZE = 6, 24, 8, 12  # of-daqp: simple bounds, all rows, acting, unknowns
_GAP = 0.01, 1.01       # of-daqp: from a side that acts, or from the answer, to the other sides

Level = tuple[Array, Array, Array]


def of_soth(rng: np.random.Generator) -> Hierarchy:
    """Return levels of random rank, in part of combinations of the rows above, all kinds of sides.

    At most n / 4 + 1 levels, together of about 0.7 n rows; sides: equal, lower, upper or both.
    """
    n = int(rng.integers(*_UNKNOWNS))
    count = int(rng.integers(1, 2 + n // 4))
    most = max(2, round(0.7 * n / count))
    levels: list[Level] = []
    for k in range(count):
        m = int(rng.integers(1, most + 1))
        free = m if rng.random() < 0.3 else int(rng.integers(1, m + 1))
        A = _entries(rng, m, free) @ _entries(rng, free, n)
        linked = int(rng.integers(0, m + 1)) if k else 0
        for above, _, _ in levels if linked else ():
            A += _entries(rng, m, linked) @ _entries(rng, linked, len(above)) @ above
        high, low = rng.uniform(0.0, 2.0, m), rng.uniform(-2.0, 0.0, m)
        kind = rng.integers(4, size=m)
        low = np.select([kind == 0, kind == 1], [high, -np.inf], low)
        levels.append((A, low, np.where(kind == 2, np.inf, high)))
    return Hierarchy.from_levels(levels)


def of_lexls(rng: np.random.Generator) -> Hierarchy:
    """Return equalities in levels that each add a given rank to the rows above them.

    Every row is a random combination of all rows above and of new ones; in half of the problems
    the first level fixes unknowns.
    """
    n = int(rng.integers(*_UNKNOWNS))
    above, levels = np.empty((0, n)), []
    for k in range(int(rng.integers(2, 6))):
        m = int(rng.integers(1, 1 + max(2, n // 3)))
        if k == 0 and rng.random() < 0.5:
            A = np.eye(n)[rng.permutation(n)[:m]]
        else:
            new = rng.normal(size=(int(rng.integers(0 if k else 1, m + 1)), n))
            known = np.vstack([above, new])
            A = rng.normal(size=(m, len(known))) @ known
        levels.append((A, rng.normal(size=m)))
        above = np.vstack([above, A])
        above = above / max(1.0, abs(above).max())
    return Hierarchy.from_levels(levels)


def of_daqp(rng: np.random.Generator) -> Hierarchy:
    """Return a program with a known set of acting rows: bounds and rows, then |T x + v|.

    The condition number of T^T T is 100; the answer T x + v = -M_a^T lam has lam > 0 by
    construction.
    """
    n, m = _SIZE, _ROWS
    roots = np.sqrt([1.0, _CONDITION, *rng.uniform(1.0, _CONDITION, n - 2)])
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    T, v = roots[:, None] * Q.T, rng.normal(size=n)
    M = np.vstack([(Q / roots)[:_BOUNDS], rng.normal(size=(m - _BOUNDS, n))])
    sign = np.where(np.arange(m) < _ACTIVE, rng.choice([-1.0, 1.0], m), 0.0)[rng.permutation(m)]
    u = -(M * sign[:, None]).T @ rng.uniform(size=m)
    upper, lower = (M @ u + side * rng.uniform(*_GAP, m) * (sign != side) for side in (1.0, -1.0))
    return Hierarchy.from_levels([(M @ T, lower - M @ v, upper - M @ v), (T, -v)])


def _entries(rng: np.random.Generator, rows: int, columns: int) -> Array:
    return rng.uniform(-1.0, 1.0, (rows, columns))


def of_examples(name: str, seed: int, count: int) -> list[Hierarchy]:
    """Return recorded problems in turn; of another seed than 0, with other targets.

    A new target of an equality below the first level is between -s and s, with s the largest
    target of its level, or 1 where all are zero.
    """
    kept = read(DATA / f"{name}.npz").problems
    if not seed:
        return list(kept[:count])
    return [_aimed(kept[i % len(kept)], np.random.default_rng([seed, i])) for i in range(count)]


def _aimed(h: Hierarchy, rng: np.random.Generator) -> Hierarchy:
    lower, upper = h.lower.copy(), h.upper.copy()
    for i, j in zip(h.offsets[1:-1], h.offsets[2:], strict=True):
        equal = lower[i:j] == upper[i:j]
        size = np.abs(lower[i:j][equal]).max(initial=0.0) or 1.0
        target = rng.uniform(-size, size, j - i)
        lower[i:j][equal] = upper[i:j][equal] = target[equal]
    return h.changed(lower=lower, upper=upper)


_FREE = 5.0     # [rad/s] bound of a joint that has none
_QUARTER = np.pi / 2.0
_TURNED = 3     # joints that are not straight, at most
_TRIALS = 50    # postures tried until one is singular
_SINGULAR = 1e-12  # smallest singular value of all tasks
_NEAR = (-7.0, -2.0)  # decimal logarithm of the distance from a singular posture [rad]


@final
@dataclass(frozen=True)
class Posed:
    """What a family has: a robot by a name that `Robot.load` knows, and frames that tasks move.

    feet : frames whose pose is kept, the most important tasks. hands : frames that are moved.
    """

    what: str
    model: str
    hands: tuple[str, ...]
    feet: tuple[str, ...] = ()


ROBOTS = {
    "singular-lwr": Posed("KUKA LWR at and near singular postures", "kuka_lwr", ("end_effector",)),
    "singular-dual-arm": Posed("an upper body with two arms, likewise", "dual_arm",
                               ("left_hand", "right_hand")),
    "singular-humanoid": Posed("a humanoid on two feet, likewise", "humanoid",
                               ("right_hand", "left_hand"), ("left_foot", "right_foot")),
    "singular-panda": Posed("Franka Panda, likewise (extra `descriptions`)",
                            "example_robot_data:panda", ("panda_hand",)),
    "singular-romeo": Posed("Romeo on two feet, likewise (extra `descriptions`)",
                            "example_robot_data:romeo", ("r_gripper", "l_gripper"),
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
