"""Loops over the problems of a batch, for one thread: which of them, and what each is solved by.

All arrays have the problem as their first axis. A row of `answers` is x (n,), which comes in as the
reference, the record of the solver, and its code. Without the lock of Python, so that other threads
run their own part meanwhile. Each kernel returns TOO_SMALL where `work` is, which depends on the
shape alone and so shows at the first problem.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.compiled import inlined, unlocked
from solvers.kernels.bounds import solve_within_bounds
from solvers.kernels.exact import solve_exactly
from solvers.kernels.staircase import solve_by_staircase
from solvers.status import SOLVED, TOO_SMALL


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
def batch_bounds(A, lower, upper, sizes, answers, settings, which, work):
    """Solve the problems `which` within their bounds."""
    for p in which:
        x, record = _parts(answers, p, A.shape[2])
        code = solve_within_bounds(A[p], lower[p], upper[p], sizes, x, record, settings, work)
        answers[p, -1] = code
        if code == TOO_SMALL:
            return TOO_SMALL
    return SOLVED


@unlocked
def batch_exact(A, lower, upper, sizes, answers, settings, which, work):
    """Solve the problems `which` by the exact engine."""
    for p in which:
        x, record = _parts(answers, p, A.shape[2])
        code = solve_exactly(A[p], lower[p], upper[p], sizes, x, record, settings, work)
        answers[p, -1] = code
        if code == TOO_SMALL:
            return TOO_SMALL
    return SOLVED
