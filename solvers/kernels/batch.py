"""Loops over the problems of a batch, for one thread: which of them, and what each is solved by.

All arrays have the problem as their first axis. A row of `answers` is x (n,), which comes in as the
reference, the record of the solver, and its code. Without the lock of Python, so that other threads
run their own part meanwhile. Each kernel returns TOO_SMALL where `work` is, which depends on the
shape alone and so shows at the first problem.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.compiled import inlined, unlocked
from solvers.kernels.hcod import hcod, hcod_equalities
from solvers.kernels.saturation import saturation
from solvers.kernels.stages import solve_by_stages
from solvers.kernels.staircase import solve_by_staircase
from solvers.status import SOLVED, TOO_SMALL, UNPROVED


@inlined
def _parts(answers, p, n):
    """Return x and the record of problem p."""
    return answers[p, :n], answers[p, n:-1]


@unlocked
def batch_staircase(A, lower, upper, sizes, answers, settings, which, work):
    """Solve the problems `which` by the staircase; the record is not used."""
    for p in which:
        x, _ = _parts(answers, p, A.shape[2])
        code = solve_by_staircase(A[p], lower[p], upper[p], sizes, x, settings, work)
        answers[p, -1] = code
        if code == TOO_SMALL:
            return TOO_SMALL
    return SOLVED


@unlocked
def batch_saturation(A, lower, upper, sizes, answers, settings, which, work):
    """Solve the problems `which` by `saturation`."""
    for p in which:
        x, record = _parts(answers, p, A.shape[2])
        code = saturation(A[p], lower[p], upper[p], sizes, x, record, settings[0], settings[1],
                          settings[2], work)
        answers[p, -1] = code
        if code == TOO_SMALL:
            return TOO_SMALL
    return SOLVED


@unlocked
def batch_hcod(A, lower, upper, sizes, answers, settings, which, work):
    """Solve the problems `which` by guesses, or by the staircase if all rows are equalities."""
    for p in which:
        (x, record), code = _parts(answers, p, A.shape[2]), UNPROVED
        if lower.shape[1] == 0 or lower[p, 0] == upper[p, 0]:
            code = hcod_equalities(A[p], lower[p], upper[p], sizes, x, record, settings, work)
        if code == UNPROVED:
            code = hcod(A[p], lower[p], upper[p], sizes, x, record, settings, work)
        answers[p, -1] = code
        if code == TOO_SMALL:
            return TOO_SMALL
    return SOLVED


@unlocked
def batch_stages(A, lower, upper, sizes, answers, settings, which, work):
    """Solve the problems `which` level by level."""
    for p in which:
        x, record = _parts(answers, p, A.shape[2])
        code = solve_by_stages(A[p], lower[p], upper[p], sizes, x, record, settings, work)
        answers[p, -1] = code
        if code == TOO_SMALL:
            return TOO_SMALL
    return SOLVED
