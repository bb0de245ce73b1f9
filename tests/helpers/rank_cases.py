"""Hierarchies of equalities at every rank, the stored families, how problems change, answers."""

import numpy as np

from hierarchy import Hierarchy
from scenarios.problems import recorded as families
from solvers import Status


def rng(seed=7):
    return np.random.default_rng(seed)


def random_levels(n, sizes, seed=7):
    r = rng(seed)
    return [(r.normal(size=(m, n)), r.normal(size=m)) for m in sizes]


def cases():
    """Yield a name and levels (A, b)."""
    yield "generic", random_levels(7, (3, 1, 1))
    yield "more_rows_than_joints", random_levels(6, (3, 2, 3))
    levels = random_levels(5, (3, 3))
    levels[0][0][2] = levels[0][0][0] - 2.0 * levels[0][0][1]
    yield "rank_lost_inside_the_first_level", levels
    levels = random_levels(6, (3, 2, 3))
    levels[1][0][0] = [0.5, -1.0, 2.0] @ levels[0][0]
    yield "middle_level_dependent_on_the_first", levels
    levels = random_levels(8, (3, 2, 2))
    levels[2][0][:] = rng(1).normal(size=(2, 5)) @ np.vstack([levels[0][0], levels[1][0]])
    yield "last_level_wholly_dependent", levels
    levels = random_levels(7, (3, 3, 3, 3))
    levels[0][0][1] = levels[0][0][0]
    yield "row_repeated_inside_a_level", levels
    levels = random_levels(7, (2, 2, 2))
    levels[2][0][:] = levels[0][0]
    yield "rows_repeated_in_a_lower_level", levels
    levels = random_levels(6, (2, 2, 2))
    levels[0][0][1] = levels[1][0][:] = 0.0
    yield "zero_rows", levels
    A = rng().normal(size=(2, 4))
    yield "conflicting_targets", [(A, [1.0, 2.0]), (A, [-1.0, 0.0]), (A[:1], [5.0])]
    yield "one_joint", [([[0.0]], [1.0]), ([[2.0]], [1.0]), ([[1.0]], [3.0])]
    yield "no_freedom_left", random_levels(4, (4, 3, 2))
    yield "levels_without_rows", random_levels(5, (0, 2, 0, 1, 0))
    yield "no_levels", []
    yield "unequal_scales", [(A * scale, b * scale) for (A, b), scale in zip(
        random_levels(7, (3, 2, 2)), (1e4, 1e-5, 1.0), strict=True)]


CASES = dict(cases())


def build(case, with_reference):
    levels = CASES[case]
    n = np.shape(levels[0][0])[1] if levels else 3
    reference = rng(3).normal(size=n) if with_reference or not levels else None
    return Hierarchy.from_levels(levels, reference)


def boxed(h, low, high):
    """Return h with the bounds low <= x <= high as its first level."""
    box = np.eye(h.n), np.broadcast_to(low, h.n), np.broadcast_to(high, h.n)
    return Hierarchy.from_levels([box, *((A, b) for A, b, _ in h.levels())], h.reference)


def solved(resolver, h, memory=None):
    """Resolve h, and check that it was solved."""
    found = resolver.solve(h, memory)
    assert found.status is Status.SOLVED
    return found


def gap(x, expected):
    """Return the largest difference, relative to 1 + the largest entry expected."""
    return np.abs(x - expected).max(initial=0.0) / (1.0 + np.abs(expected).max(initial=0.0))


def family(name):
    """Yield (hierarchy, x, norms) of a reference family; see scenarios/problems/data/README.md."""
    for problem in families.family(name):
        yield problem.h, problem.proof.x, problem.proof.least


def sequence(h, count, seed=0):
    """A hierarchy as it changes from tick to tick, and back to its beginning.

    Rows with one coefficient, such as bounds, keep it.
    """
    rng = np.random.default_rng(seed)
    size = np.linalg.norm(h.A, axis=1)
    directions = rng.normal(size=(2, h.m)), rng.normal(size=(2, *h.A.shape))
    directions[1][:, np.count_nonzero(h.A, axis=1) == 1] = 0.0
    ticks = []
    for phase in 2.0 * np.pi * np.arange(count) / count:
        turn = np.array([np.sin(phase), np.cos(phase)])
        shift = 0.1 * size * (turn @ directions[0])
        A = h.A * (1.0 + 0.02 * np.einsum("t,tij->ij", turn, directions[1]))
        ticks.append(h.changed(A=A, lower=h.lower + shift, upper=h.upper + shift))
    return ticks


def moved(h, seed=0):
    """h with both sides of every row scaled by one factor within 1 % of 1."""
    factor = 1.0 + 0.01 * np.random.default_rng(seed).uniform(-1.0, 1.0, h.m)
    return h.changed(lower=h.lower * factor, upper=h.upper * factor)
