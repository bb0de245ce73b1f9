"""The loop over the problems of a batch, for one thread."""

from hierarchy.jit import unlocked
from solvers.kernels.active_set.exact import solve
from solvers.kernels.bounds import solve_within_bounds
from solvers.kernels.merged import merged
from solvers.status import SOLVED, TOO_SMALL

WITHIN_BOUNDS, EXACT, MERGED = range(3)


@unlocked
def solve_batch(way, problems, x, codes, records, settings, which, work):
    """Solve the problems `which` like `Tpm`, with the exact kernel, or like `Merged`.

    problems: A (B, m, n), lower, upper (B, m), sizes (L,). The other arrays also have the problem
    as their first axis: x (B, n), references on entry, the codes, and the records of the resolver.
    Other threads run meanwhile. Returns TOO_SMALL before it solves anything if `work` is too small.
    """
    A, lower, upper, sizes = problems
    for p in which:
        problem = A[p], lower[p], upper[p], sizes, x[p], records[p], settings, work
        if way == WITHIN_BOUNDS:
            codes[p] = solve_within_bounds(*problem)
        elif way == EXACT:
            codes[p] = solve(*problem)
        else:
            codes[p] = merged(*problem)
        if codes[p] == TOO_SMALL:
            return TOO_SMALL
    return SOLVED
