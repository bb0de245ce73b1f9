"""Loops over the problems of a batch, for one thread.

problems: A (B, m, n), lower, upper (B, m), sizes (L,). The other arrays also have the problem as
their first axis: x (B, n), the reference on entry, the records of the resolver, and the codes. The
kernels release the GIL, so that other threads run their own part. Each kernel returns TOO_SMALL
before it solves anything if `work` is too small.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.jit import unlocked
from solvers.kernels.bounds import name_saturation, solve_without_bounds
from solvers.kernels.exact import DAMPING, solve_damped, solve_hierarchy, work_size
from solvers.kernels.merged import merged
from solvers.kernels.staircase import solve_by_staircase
from solvers.status import SOLVED, TOO_SMALL


@unlocked
def batch_staircase(problems, x, codes, settings, which, work):
    """Solve the problems `which` with the staircase."""
    A, lower, upper, sizes = problems
    for p in which:
        codes[p] = solve_by_staircase(A[p], lower[p], upper[p], sizes, x[p], settings, work)
        if codes[p] == TOO_SMALL:
            return TOO_SMALL
    return SOLVED


@unlocked
def batch_without_bounds(problems, x, codes, records, settings, which, work):
    """Solve the problems `which` as if they had no bounds."""
    A, lower, upper, sizes = problems
    for p in which:
        codes[p] = solve_without_bounds(A[p], lower[p], upper[p], sizes, x[p], records[p],
                                        settings, work)
        if codes[p] == TOO_SMALL:
            return TOO_SMALL
    return SOLVED


@unlocked
def batch_saturation(problems, x, codes, records, which, work):
    """Write the saturation and scaling of the problems `which`; codes: of `name_saturation`."""
    A, lower, upper, sizes = problems
    for p in which:
        codes[p] = name_saturation(A[p], lower[p], upper[p], sizes, x[p], records[p], work)
    return SOLVED


@unlocked
def batch_exact(problems, x, codes, records, settings, which, work):
    """Solve the problems `which` with the exact kernel.

    The record of the exact resolver is the last part of each record.
    """
    A, lower, upper, sizes = problems
    begin = records.shape[1] - 3 * A.shape[1] - 3
    if work_size(A.shape[2], A.shape[1], sizes.size, settings[DAMPING] > 0.0) > work.size:
        return TOO_SMALL
    for p in which:
        record = records[p, begin:]
        codes[p] = (solve_damped(A[p], lower[p], upper[p], sizes, x[p], record, settings, work)
                    if settings[DAMPING] > 0.0 else
                    solve_hierarchy(A[p], lower[p], upper[p], sizes, x[p], record, settings, work))
    return SOLVED


@unlocked
def batch_merged(problems, x, codes, records, settings, which, work):
    """Solve the problems `which` with the kernel of `merged`."""
    A, lower, upper, sizes = problems
    for p in which:
        codes[p] = merged(A[p], lower[p], upper[p], sizes, x[p], records[p], settings, work)
        if codes[p] == TOO_SMALL:
            return TOO_SMALL
    return SOLVED
