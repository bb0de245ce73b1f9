"""Loops over the problems of a batch, for one thread: which of them, and what each is solved by.

All arrays have the problem as their first axis; x comes in as the reference. Without the lock of
Python, so that other threads run their own part meanwhile. Each kernel returns False where `work`
is too small, which depends on the shape alone and so shows at the first problem.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.compiled import unlocked
from solvers.kernels.hcod import UNPROVED, hcod, hcod_equalities
from solvers.kernels.saturation import saturation
from solvers.kernels.stages import solve_by_stages
from solvers.kernels.staircase import staircase
from solvers.status import TOO_SMALL


@unlocked
def batch_staircase(A, lower, upper, sizes, x, record, codes, settings, which, work):
    """Solve the problems `which` by `staircase`; record is not used."""
    for p in which:
        codes[p] = staircase(A[p], lower[p], upper[p], sizes, x[p], settings[0], settings[1],
                             settings[2], work)
        if codes[p] == TOO_SMALL:
            return False
    return True


@unlocked
def batch_saturation(A, lower, upper, sizes, x, record, codes, settings, which, work):
    """Solve the problems `which` by `saturation`."""
    for p in which:
        codes[p] = saturation(A[p], lower[p], upper[p], sizes, x[p], record[p], settings[0],
                              settings[1], settings[2], work)
        if codes[p] == TOO_SMALL:
            return False
    return True


@unlocked
def batch_hcod(A, lower, upper, sizes, x, record, codes, settings, which, work):
    """Solve the problems `which` by guesses, or by the staircase if all rows are equalities."""
    for p in which:
        code = UNPROVED
        if lower.shape[1] == 0 or lower[p, 0] == upper[p, 0]:
            code = hcod_equalities(A[p], lower[p], upper[p], sizes, x[p], record[p], settings,
                                   work)
        if code == UNPROVED:
            code = hcod(A[p], lower[p], upper[p], sizes, x[p], record[p], settings, work)
        codes[p] = code
        if code == TOO_SMALL:
            return False
    return True


@unlocked
def batch_stages(A, lower, upper, sizes, x, record, codes, settings, which, work):
    """Solve the problems `which` level by level."""
    for p in which:
        codes[p] = solve_by_stages(A[p], lower[p], upper[p], sizes, x[p], record[p], settings,
                                   work)
        if codes[p] == TOO_SMALL:
            return False
    return True
