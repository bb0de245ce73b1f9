"""Loops over the problems of a batch, for one thread: which of them, and what each is solved by.

All arrays have the problem as their first axis; x comes in as the reference. Without the lock of
Python, so that other threads run their own part meanwhile. Each kernel returns False where `work`
is too small, which depends on the shape alone and so shows at the first problem.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.compiled import unlocked
from solvers.kernels.bounds import solve_within_bounds
from solvers.kernels.exact import solve_exactly
from solvers.kernels.staircase import solve_by_staircase
from solvers.status import TOO_SMALL


@unlocked
def batch_staircase(A, lower, upper, sizes, x, record, codes, settings, which, work):
    """Solve the problems `which` by `solve_by_staircase`; record is not used."""
    for p in which:
        codes[p] = solve_by_staircase(A[p], lower[p], upper[p], sizes, x[p], settings, work)
        if codes[p] == TOO_SMALL:
            return False
    return True


@unlocked
def batch_bounds(A, lower, upper, sizes, x, record, codes, settings, which, work):
    """Solve the problems `which` by `solve_within_bounds`."""
    for p in which:
        codes[p] = solve_within_bounds(A[p], lower[p], upper[p], sizes, x[p], record[p], settings,
                                       work)
        if codes[p] == TOO_SMALL:
            return False
    return True


@unlocked
def batch_exact(A, lower, upper, sizes, x, record, codes, settings, which, work):
    """Solve the problems `which` by `solve_exactly`."""
    for p in which:
        codes[p] = solve_exactly(A[p], lower[p], upper[p], sizes, x[p], record[p], settings, work)
        if codes[p] == TOO_SMALL:
            return False
    return True
