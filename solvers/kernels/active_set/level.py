"""One level in an orthogonal tableau: its step, and the rows that hold it back.

With the rows of a level lower triangular in its basis vectors, y solves L y = rest if they are
independent, and the least squares problem if they are not. The force lambda_t of each row above,
by back substitution in sum_t lambda_t a_t = -A_k^T w_k, says whether that row holds the level back.
"""

from hierarchy.jit import as_matrix, inlined
from solvers.kernels.active_set.tableau import (
    COLUMN,
    FORCE,
    LIST,
    OVER,
    OWNER,
    PULL,
    PULLED,
    REST,
    ROUNDING,
    ROWS,
    SCALE,
    SHARE,
    SIZE,
    WORST,
    Z,
    around,
    entry_of,
    left_of,
)
from solvers.kernels.active_set.working_set import NORM, TOLERANCE, side_at
from solvers.kernels.linalg.least_squares import least_squares
from solvers.kernels.linalg.space import fill
from solvers.kernels.tolerances import CANCELLED, EPSILON, FAINT


@inlined
def step_of_rows(t, begin, rank):
    """Write the step of a level into Z, and the excess of its rows after the step.

    Independent rows are met. Returns the size of the largest numbers involved.
    """
    if t.count[ROWS] > rank:
        return _least_squares_step(t, begin, rank)
    s, size, y = t.of, 0.0, t.of.number[Z, begin:]
    for q in range(rank):
        i, left = s.index[LIST, q], s.number[REST, q]
        column, entry = s.index[COLUMN, i], entry_of(t, i)
        diagonal = entry * t.M[begin + q, column]
        size = max(size, abs(left / diagonal))
        for c in range(q):
            left -= entry * t.M[begin + c, column] * y[c]
        y[q] = left / diagonal
        s.number[OVER, q] = 0.0
    return size


@inlined
def _least_squares_step(t, begin, rank):
    """Like `step_of_rows`, for more rows than rank."""
    s, rows, size, y = t.of, t.count[ROWS], 0.0, t.of.number[Z, begin:]
    L = as_matrix(t.room[:rows * (rank + 1)], rank + 1, rows)
    for q in range(rows):
        i, rest = s.index[LIST, q], s.number[REST, q]
        column, entry, least = s.index[COLUMN, i], entry_of(t, i), s.scalar[TOLERANCE]
        seen = left_of(t, i, begin, begin + rank) > (least * s.number[NORM, i]) ** 2
        for c in range(rank):  # entries of a row in the span of the rows above are rounding
            L[c, q] = entry * t.M[begin + c, column] if c <= q and seen else 0.0
        L[rank, q] = rest
        if q < rank:
            size = max(size, abs(rest / L[q, q]))
    least_squares(L[:rank], L[rank], y)
    for q in range(rows):
        s.number[OVER, q] = -L[rank, q]
    return size


@inlined
def weigh_rows(t):
    """Write the largest violation of the rows of a level, and the sum of their forces.

    If the misses are rounding in all rows, they count as zero; in a single row the miss may be what
    balances a light row. The share of rounding in a pull is that in the miss.
    """
    s, worst, pulled, missed = t.of, 0.0, 0.0, False
    for q in range(t.count[ROWS]):
        i, over = s.index[LIST, q], abs(s.number[OVER, q])
        side = side_at(s, i)
        missed |= over > EPSILON * around(s, i, side, t.scalar[SIZE])
        pulled += s.number[NORM, i] * over
        if over > 0.0:
            worst = max(worst, over / around(s, i, side, t.scalar[SCALE]))
    if not missed:
        worst = pulled = 0.0
        fill(s.number[OVER, :t.count[ROWS]], 0.0)
    t.scalar[WORST], t.scalar[PULLED] = worst, pulled
    length = worst * t.scalar[SCALE]
    share = min(EPSILON * t.scalar[SIZE] / length, 1.0) if length > 0.0 else 0.0
    t.scalar[ROUNDING] = pulled * max(CANCELLED, share)


@inlined
def pull_of_rows(t, begin, end):
    """Add the excess of the rows of a level, times the rows, in the basis vectors begin .. end."""
    for q in range(t.count[ROWS]):
        if t.of.number[OVER, q] != 0.0:
            push_by(t, t.of.index[LIST, q], t.of.number[OVER, q], begin, end)


@inlined
def push_by(t, i, over, begin, end):
    """Add row i times its excess, without entries so faint that they decide nothing."""
    s, column, entry = t.of, t.of.index[COLUMN, i], entry_of(t, i)
    faint, push = FAINT * abs(s.number[NORM, i] / entry), over * entry
    for k in range(begin, end):
        s.number[PULL, k] += push * t.M[k, column] if abs(t.M[k, column]) > faint else 0.0


@inlined
def balance(t, begin, end):
    """Write the forces of the rows that own the basis vectors begin .. end - 1.

    A pull that may be rounding alone counts as zero: every entry of a row is rounded relative to
    its norm.
    """
    s, pull, force, share = t.of, t.of.number[PULL], t.of.number[FORCE], t.of.number[SHARE]
    rounding = t.scalar[ROUNDING]
    for k in range(end - 1, begin - 1, -1):
        force[k], share[k] = 0.0, abs(pull[k])
        i = s.index[OWNER, k]
        if i < 0 or share[k] <= rounding:
            continue
        column, entry = s.index[COLUMN, i], entry_of(t, i)
        force[k] = -pull[k] / (entry * t.M[k, column])
        rounding += CANCELLED * abs(force[k]) * s.number[NORM, i]
        for c in range(begin, k):
            pull[c] += force[k] * entry * t.M[c, column]
