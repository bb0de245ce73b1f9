"""Problems as the makers of other solvers test theirs, written anew from what their tests describe.

of-soth: stack-of-tasks/soth, unitTesting/RandomGenerator.cpp (randomProblem). of-lexls:
jrl-umi3218/lexls, interfaces/matlab-octave/tests/lexlse/define_problem.m. of-daqp: darnstrom/daqp,
interfaces/DAQP.jl/test/utils.jl (generate_test_QP), with the objective as the level below.

Others were recorded in the examples of packages that own the robot's model: `data/README.md`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hierarchy.problem import Array, Hierarchy
from solvers.problems.files import read

_UNKNOWNS = 4, 20       # of-soth, of-lexls: least and most
_CONDITION = 100.0      # of-daqp: of the Hessian
_BOUNDS, _ROWS, _ACTIVE, _SIZE = 6, 24, 8, 12  # of-daqp: simple bounds, all rows, acting, unknowns
_GAP = 0.01, 1.01       # of-daqp: from a side that acts, or from the answer, to the other sides

_DATA = Path(__file__).parent / "data"

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
    kept = read(_DATA / f"{name}.npz").problems
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
