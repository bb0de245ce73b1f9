"""Loops over the problems of a batch, for one thread.

problems: A (B, m, n), lower, upper (B, m), sizes (L,). The other arrays also have the problem as
their first axis: x (B, n), references on entry, the codes, and the records of the resolver. The
kernels release the GIL, so that other threads run their own part. Each returns TOO_SMALL before it
solves anything if `work` is too small.
"""

from hierarchy.jit import unlocked
from solvers.kernels.active_set.exact import solve
from solvers.kernels.bounds import solve_within_bounds
from solvers.kernels.merged import merged
from solvers.status import SOLVED, TOO_SMALL


@unlocked
def batch_within_bounds(problems, x, codes, records, settings, which, work):
    """Solve the problems `which` like `Tpm`."""
    A, lower, upper, sizes = problems
    for p in which:
        codes[p] = solve_within_bounds(A[p], lower[p], upper[p], sizes, x[p], records[p], settings,
                                       work)
        if codes[p] == TOO_SMALL:
            return TOO_SMALL
    return SOLVED


@unlocked
def batch_exact(problems, x, codes, records, settings, which, work):
    """Solve the problems `which` with the exact kernel."""
    A, lower, upper, sizes = problems
    for p in which:
        codes[p] = solve(A[p], lower[p], upper[p], sizes, x[p], records[p], settings, work)
        if codes[p] == TOO_SMALL:
            return TOO_SMALL
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
