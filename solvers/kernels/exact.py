"""The exact engine: equalities by staircase, a known working set by proof, all else by levels."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.compiled import compiled, inlined
from solvers.kernels.guess import solve_by_guesses
from solvers.kernels.levels import end_of_levels, solve_by_levels
from solvers.kernels.staircase import solve_by_staircase
from solvers.status import EQUAL, TOO_SMALL, UNPROVED


@compiled
def solve_exactly(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) comes in as the reference and goes out as the answer, zero on failure.

    record (3 m + 3,) comes in as zeros, or as that of an earlier solve, and goes out as
    `solve_by_guesses` says; settings: those of `Hcod`. Returns SOLVED, ITERATION_LIMIT,
    NUMERICAL_FAILURE, INACCURATE, or TOO_SMALL, and then nothing was done.
    """
    m = lower.size
    if end_of_levels(A, lower, upper, sizes, x, work) > work.size:
        return TOO_SMALL
    if all_equal(lower, upper):
        for i in range(m):
            record[i], record[m + i], record[2 * m + i] = EQUAL, -1.0, 0.0
        record[3 * m], record[3 * m + 1], record[3 * m + 2] = 1.0, 0.0, -1.0
        return solve_by_staircase(A, lower, upper, sizes, x, settings, work)
    known = record[3 * m] + record[3 * m + 1] > 0.0
    record[3 * m] = 0.0
    if known and settings[0] == 0.0:
        code = solve_by_guesses(A, lower, upper, sizes, x, record, settings, work)
        if code != UNPROVED:
            return code
    return solve_by_levels(A, lower, upper, sizes, x, record, settings, work)


@inlined
def all_equal(lower, upper):
    """Whether all rows are equalities."""
    equal = True
    for i in range(lower.size):
        equal &= lower[i] == upper[i]
    return equal
