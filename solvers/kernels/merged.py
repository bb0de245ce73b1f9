"""Levels below the strict ones as one weighted level, with targets that move by what was missed.

Rows of the strict levels stay as they are; all others are multiplied by the weight of their level
and become one level. Rows that draw x to the reference follow, for the unknowns that no row of that
level names alone, so that it has full column rank. The exact kernel solves this. A row with a
memory y aims at sides moved by y, and then

    z = a x - y,  r = clip(z, lower, upper) - a x,  y <- clip(y + step clip(r))              (a)

where clip without sides is to +-cap. For an equality a x = b this is what the method of multipliers
does to a multiplier, y + step (b - a x), in the unit of the row; a miss beyond the cap moves y by
step times cap. docs/theory/merged.md has the bounds.
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import add_multiple, compiled, inlined, inner_product, internal
from solvers.kernels.active_set.exact import DAMPING, solve, work_size
from solvers.kernels.linalg.rows import only_entry
from solvers.kernels.linalg.space import assign, fill, integers, matrix, vector
from solvers.status import NUMERICAL_FAILURE, TOO_SMALL

NOTHING = -1     # code: every level is strict
BY_RULE, TOP_LIMITS = -1.0, -2.0  # of strict levels: see `count_strict`
EXACT = 5        # settings of `Hcod` at the start; then those of `Merged`
OWN = 8          # settings before the weights

Merged = namedtuple(
    "Merged", "strict regularisation step weights caps A lower upper sizes own centre")
"""The settings of `Merged`, weights and caps (L,), and the rows that are solved.

A (m + n, n), of which the first `m` and some more are written. own (n,): 1 for an unknown that
a row to merge names alone. centre (n,): with damping, the reference, from which x is then
counted.
"""


@compiled
def record_size(n, m):
    """Return the numbers of a record, see `merged`."""
    return 4 * m + 3 * n + 4


@inlined
def merged_size(n, m, levels, damped):
    """Return the numbers that a work space of `merged` needs."""
    return (m + n) * (n + 2) + levels + 2 * n + work_size(n, m + n, levels, damped)


@compiled
def write_levels(settings, ratio, cap, scale):
    """Write the weights and caps of levels with these scales (L,) behind the other settings."""
    weight, levels = 1.0, scale.size
    for k in range(levels - 1, -1, -1):
        settings[OWN + k], settings[OWN + levels + k] = weight / scale[k], cap * scale[k]
        weight *= ratio


@compiled
def merged(A, lower, upper, sizes, x, record, settings, work):
    """Solve; x (n,) is the reference on entry and the answer on return, zero on failure.

    record: y (m,), iterations, and the record of the exact kernel, (3 (m + n) + 3,); on entry that
    of an earlier solve, or zeros. settings: those of `Hcod`, then of `Merged`. work: any contents.
    Returns the codes of `solve_hierarchy`, or NOTHING if no level is left to merge.
    """
    (m, n), levels = A.shape, sizes.size
    s, at = _carve(settings, work, m, n, levels)
    strict, damped = count_strict(lower, upper, sizes, s.strict), settings[DAMPING] > 0.0
    if strict >= levels > 0 and s.strict != TOP_LIMITS:
        return NOTHING
    if merged_size(n, m, levels, damped) > work.size:
        return TOO_SMALL
    y, last = record[:m], min(strict + 1, levels)
    if damped:
        assign(s.centre, x)
        fill(x, 0.0)
    _merge(s, A, lower, upper, sizes, strict, y, damped)
    rows = m
    if strict < levels:
        rows = _draw(s, m, x)
        s.sizes[strict] += rows - m
    inner = record[m + 1:m + 3 * rows + 4]
    code = solve(s.A[:rows], s.lower[:rows], s.upper[:rows], s.sizes[:last], x, inner,
                 settings[:EXACT], work[at:])
    record[m] = inner[3 * rows] + inner[3 * rows + 1]
    if code != NUMERICAL_FAILURE:
        if damped:
            add_multiple(x, 1.0, s.centre)
        _carry(s, A, lower, upper, sizes, x, y, strict)
    return code


@compiled
def count_strict(lower, upper, sizes, given):
    """Return how many levels stay strict: those that are set, or by a rule.

    BY_RULE: the first run of levels with inequalities and all levels above it; none if no level has
    inequalities. TOP_LIMITS: the top level, if it has inequalities.
    """
    if given >= 0.0:
        return np.int64(given)
    first, strict = 0, 0
    for k in range(sizes.size):
        last, bounded = first + sizes[k], False
        for i in range(first, last):
            bounded |= lower[i] < upper[i]
        if bounded:
            strict = k + 1
        if sizes[k] > 0 and (given == TOP_LIMITS or (strict > 0 and not bounded)):
            break
        first = last
    return strict


@inlined
def _carve(settings, work, m, n, levels):
    """Return Merged without content, and where it ends in the work space."""
    strict, regularisation, step = settings[EXACT], settings[EXACT + 1], settings[EXACT + 2]
    weights, caps = settings[OWN:OWN + levels], settings[OWN + levels:]
    A, at = matrix(work, 0, m + n, n)
    lower, at = vector(work, at, m + n)
    upper, at = vector(work, at, m + n)
    sizes, at = integers(work, at, levels)
    own, at = vector(work, at, n)
    centre, at = vector(work, at, n)
    return Merged(strict, regularisation, step, weights, caps, A, lower, upper, sizes, own,
                  centre), at


@internal
def _merge(s, A, lower, upper, sizes, strict, y, damped):
    """Write the rows of all levels, those to merge times their weights and at moved sides."""
    first, hard = 0, 0
    fill(s.own, 0.0)
    for k in range(sizes.size):
        hard, cap = first if k == strict else hard, _cap(s, sizes, k, strict)
        for i in range(first, first + sizes[k]):
            y[i] = min(max(y[i], -cap), cap) if np.isfinite(y[i]) else 0.0
            moved, weight = y[i], 1.0
            if k >= strict:
                weight, only = s.weights[k], only_entry(A[i])
                if only >= 0 and lower[i] == upper[i]:
                    s.own[only] = 1.0
                if only < 0 and _repeats(A, lower, upper, i, hard):
                    weight = 0.0
            moved -= inner_product(A[i], s.centre) if damped else 0.0
            for c in range(A.shape[1]):
                s.A[i, c] = weight * A[i, c]
            s.lower[i], s.upper[i] = weight * (lower[i] + moved), weight * (upper[i] + moved)
        s.sizes[k] = sizes[k]
        if k > strict:
            s.sizes[strict] += sizes[k]
        first += sizes[k]


@inlined
def _cap(s, sizes, k, strict):
    """Return how far the sides of level k may move; strict rows and the lowest level have none."""
    return s.caps[k] if strict <= k < sizes.size - 1 else 0.0


@inlined
def _repeats(A, lower, upper, i, hard):
    """Whether equality i is one of the first `hard` rows too, which alone decide its value.

    As of a foot that stands and is a task: weighed, its miss would drown the light rows.
    """
    for j in range(hard if lower[i] == upper[i] else 0):
        c = 0
        while lower[j] == upper[j] and c < A.shape[1] and A[i, c] == A[j, c]:
            c += 1
        if c == A.shape[1]:
            return True
    return False


@internal
def _draw(s, m, x):
    """Add a row mu (x - reference) for each unknown without one; return the number of all rows."""
    rows, mu = m, s.regularisation
    for c in range(x.size):
        if mu > 0.0 and s.own[c] == 0.0:
            for e in range(x.size):
                s.A[rows, e] = mu if e == c else 0.0
            s.lower[rows] = s.upper[rows] = mu * x[c]
            rows += 1
    return rows


@internal
def _carry(s, A, lower, upper, sizes, x, y, strict):
    """Move the memory of each row, (a)."""
    first = 0
    for k in range(sizes.size):
        cap = _cap(s, sizes, k, strict)
        for i in range(first, first + sizes[k]):
            value = inner_product(A[i], x)
            miss = min(max(value - y[i], lower[i]), upper[i]) - value
            y[i] = min(max(y[i] + s.step * min(max(miss, -cap), cap), -cap), cap)
        first += sizes[k]
