"""Fresh problems like those of the reference families, a new one for every seed.

The stored families have 50 problems each, and solvers have been tuned on them. These problems have
the same sizes, ranks, row norms, sides and kinds of ties, but no seed repeats a stored problem.

INEQ7 and HUM38 have easy and hard problems. An easy problem looks like the stored ones. A hard
problem has more bounds that exclude zero and more distant targets, so more rows are active at the
answer.
"""

from collections.abc import Callable

import numpy as np

from hierarchy.errors import SEEDS, check_name, whole
from hierarchy.problem import Array, Hierarchy
from solvers.problems.kinds import Level, Random, equal, stacked

_HARD = 0.8  # share of hard problems in INEQ7 and HUM38
_PARALLEL = 1e-9  # angle [rad] of the nearly parallel rows of DEGEN7


def family(name: str, seed: int) -> Hierarchy:
    """Return one fresh problem of a reference family, reproducible from its seed.

    Raises UnknownNameError: a name not in FAMILIES.
    """
    check_name("family of problems", name, FAMILIES)
    rng = np.random.default_rng([whole("family: seed", seed, largest=SEEDS), FAMILIES.index(name)])
    return Hierarchy.from_levels(_MAKERS[name](rng))


def _equalities(n: int, *sizes: int) -> Callable[[Random], list[Level]]:
    """Return a maker of rows and targets from the standard normal distribution."""
    def make(rng: Random) -> list[Level]:
        return [equal(rng.normal(size=(size, n)), rng.normal(size=size)) for size in sizes]
    return make


def _singular(rng: Random) -> list[Level]:
    """Repeated rows and rows in the span of the rows above, with conflicting targets."""
    n = 7
    first = rng.normal(size=(2, n))
    first = np.vstack([first, first[0]])
    second = rng.normal(size=(3, n))
    second[1] = rng.normal(size=3) @ first + second[0] * (rng.random() < 2.0 / 3.0)
    if rng.random() < 0.2:
        second[2] = second[0]
    last = np.vstack([rng.normal(size=6) @ np.vstack([first, second]), rng.normal(size=n)])
    if rng.random() < 1.0 / 7.0:
        last[1] = 0.0
    third = np.vstack([first[0], rng.normal(size=n)])
    return [equal(A, rng.normal(size=len(A))) for A in (first, second, third, last)]


def _arm(rng: Random, hard: float = _HARD) -> list[Level]:
    """Joint limits, avoidance, position, cone and posture of an arm with 7 joints."""
    n, tough = 7, bool(rng.random() < hard)
    lower, upper = _box(rng, n, (5.0, 15.0), (-0.6, 0.3), 0.4 if tough else 0.12)
    reach = 1.6 if tough else 1.0
    inside = np.clip(reach * rng.uniform(-8.0, 8.0, n), lower, upper)
    avoidance = _unit(rng, 3, n)
    side = avoidance @ inside - (rng.uniform(0.0, 8.0, 3) if tough else rng.uniform(4.0, 17.0, 3))
    position = rng.uniform(0.4, 1.2) * _unit(rng, 3, n)
    cone = _unit(rng, 1, n)
    return [(np.eye(n), lower, upper), _one_sided(rng, avoidance, side),
            equal(position, position @ (reach * rng.uniform(-8.0, 8.0, n))),
            _one_sided(rng, cone, rng.normal(0.0, 1.8 * reach, 1)),
            equal(np.eye(n), reach * rng.uniform(-8.0, 8.0, n))]


def _humanoid(rng: Random) -> list[Level]:
    """Joint limits and four tasks of a humanoid with 38 joints, then its posture."""
    n, tough = 38, bool(rng.random() < _HARD)
    lower, upper = _box(rng, n, (3.0, 12.0), (-0.4, 0.3), 0.3 if tough else 0.15)
    reach = 1.3 if tough else 1.0
    rows = [rng.normal(0.0, n**-0.5, (size, n)) for size in (6, 12, 6, 6)]
    middle, half = reach * rng.normal(0.0, 3.0, 6), rng.uniform(0.2, 2.0, 6)
    return [(np.eye(n), lower, upper), equal(rows[0], reach * rng.normal(0.0, 2.0, 6)),
            equal(rows[1], reach * rng.normal(0.0, 2.0, 12)),
            (rows[2], middle - half, middle + half),
            equal(rows[3], reach * rng.normal(0.0, 4.0, 6)),
            equal(np.eye(n), reach * rng.uniform(-8.0, 8.0, n))]


def _degenerate(rng: Random) -> list[Level]:
    """An easy arm with rows repeated, negated, summed, zero and nearly parallel."""
    box, avoidance, position, cone, posture = _arm(rng, 0.0)
    if rng.random() < 1.0 / 3.0:  # equal boxes, and a posture in their corner
        box = (box[0], np.full(7, -10.0), np.full(7, 10.0))
        posture = equal(posture[0], rng.choice([-10.0, 10.0], 7))
    again, negated = rng.integers(7, size=2)
    A, lower, upper = _row(box, negated)
    box = stacked(box, _row(box, again), (-A, -upper, -lower),
                   (np.zeros((1, 7)), np.array([-1.0]), np.array([1.0])))
    aside, clash = _PARALLEL * rng.normal(size=(2, 1, 7)), rng.integers(5)
    avoidance = stacked(avoidance, _moved(_row(avoidance, 0), aside[0], 0.5 * (clash == 0)),
                         _row(avoidance, 1))
    A, b = position[:2]
    position = stacked(position, _moved(_row(position, 0), aside[1], 0.3 * (clash == 1)),
                        equal(A[1:2] + A[2:], b[1:2] + b[2:] + 0.3 * (clash == 2)))
    cone = stacked(cone, (A[:1].copy(), b[:1], b[:1] + 1.0))
    posture = stacked(posture, equal(np.zeros((1, 7)), np.array([0.7])))
    return [box, avoidance, position, cone, posture]


def _box(rng: Random, n: int, half: tuple[float, float], ratio: tuple[float, float],
         share: float) -> tuple[Array, Array]:
    """Return symmetric bounds; in a share of them one side is moved to a ratio of the other."""
    upper = np.asarray(rng.uniform(half[0], half[1], n))
    lower = -upper
    moved, above = rng.random(n) < share, rng.random(n) < 0.5
    side = rng.uniform(*ratio, n) * upper
    return np.where(moved & ~above, -side, lower), np.where(moved & above, side, upper)


def _unit(rng: Random, size: int, n: int) -> Array:
    rows = rng.normal(size=(size, n))
    return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))


def _one_sided(rng: Random, A: Array, side: Array) -> Level:
    """Return rows A x >= side; the last one is reversed with an even chance."""
    level = (A.copy(), side.copy(), np.full(len(A), np.inf))
    if rng.random() < 0.5:
        level[0][-1] *= -1.0
        level[1][-1], level[2][-1] = -np.inf, -side[-1]
    return level


def _row(level: Level, i: int) -> Level:
    A, lower, upper = level
    return A[i:i + 1].copy(), lower[i:i + 1].copy(), upper[i:i + 1].copy()


def _moved(level: Level, aside: Array, by: float) -> Level:
    A, lower, upper = level
    return A + aside, lower + by, upper + by


_MAKERS: dict[str, Callable[[Random], list[Level]]] = {
    "EQ7": _equalities(7, 3, 1, 1), "EQ7over": _equalities(7, 3, 3, 3), "EQ7sing": _singular,
    "EQ30L8": _equalities(30, *[3] * 8), "EQ30L10": _equalities(30, *[3] * 10),
    "INEQ7": _arm, "HUM38": _humanoid, "DEGEN7": _degenerate}
FAMILIES = tuple(_MAKERS)
"""The names that `family` knows."""
