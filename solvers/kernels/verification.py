"""Verification of an answer on the data: the solver's one look at optimality.

The claims are x, the side at which each row acts, and the multipliers of each level. x is optimal,
and the nearest to the reference, if

    each row that does not act lies within its sides, each other one at its side, beyond it by the
    violation claimed in its own level;                                                         (1)
    sum_i mu_pi a_i = 0 over the rows of the levels up to p, for each level p that is missed, and
    x - reference + sum_i mu_Li a_i = 0;                                                        (2)
    the first multiplier of each acting inequality that is not zero points outward.             (3)

What is left of (1) is a shift of sides, what is left of (2) a turn of the rows of level p, and both
are held against the row of least norm, so a heavy row excuses no light one. So SOLVED says: x is
exactly optimal for a problem this close to the data.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.jit import compiled, inlined
from solvers.kernels.rows import length_of
from solvers.kernels.tolerances import (
    BAND,
    CANCELLED,
    CERTAIN_SIGN,
    CUT_BALANCE,
    CUT_OVER_PIVOT,
    EPSILON,
    FREE_ROWS,
    NEGLIGIBLE,
    PIVOT_PRODUCT,
    RANK_MARGIN,
    REMAINDER,
    SIGN_MARGIN,
)
from solvers.kernels.working_set import (
    CHANGE,
    CUT,
    FIRST,
    GRADIENT,
    LOWER,
    NOISE,
    NORM,
    PIVOT,
    REFERENCE,
    SECOND,
    STATE,
    TOLERANCE,
    UNIT,
    UPPER,
    WHOLE,
    row_times_x,
)
from solvers.status import EQUAL, FREE

# What is known of an inequality that acts: nothing, a weak multiplier decided, decided.
OPEN, WEAKLY, DECIDED = range(3)


@compiled
def verify(s):
    """Whether the claims of a working set prove its x."""
    levels, whole = s.multiplier.shape[0] - 1, s.count[WHOLE]
    reach = 1.0 + length_of(s.x)
    if not np.isfinite(reach) or not _rows_hold(s, reach):
        return False
    proved = True
    for p in range(levels + 1 if whole < 0 else whole + 1):
        proved = proved and _balances(s, p, reach)
    return proved


@compiled
def neglects(s):
    """Whether x misses a row that takes no part because rows of other levels are far larger."""
    missed, reach = False, 1.0 + length_of(s.x)
    for i in range(s.A.shape[0]):
        value = row_times_x(s, i)
        over = max(value - s.number[UPPER, i], s.number[LOWER, i] - value)
        missed = missed or over > BAND * -s.number[NORM, i] * reach > 0.0
    return missed


@inlined
def _rows_hold(s, reach):
    """Whether (1) holds, down to a level that sets all of x."""
    k, whole, cut = 0, s.count[WHOLE], 0.0
    for i in range(s.index[FIRST, whole + 1] if whole >= 0 else s.A.shape[0]):
        while i >= s.index[FIRST, k + 1]:
            k += 1
        norm, state = s.number[NORM, i], s.index[STATE, i]
        if norm <= 0.0:
            continue
        value, low, up = row_times_x(s, i), s.number[LOWER, i], s.number[UPPER, i]
        side = low if state < 0 else up
        if state == FREE:
            beyond, terms = max(value - up, low - value) * FREE_ROWS, abs(value)
        else:
            beyond, terms = abs(value - side - s.multiplier[k, i]), abs(value) + abs(side)
        if not beyond <= (BAND * norm + max(s.number[CUT, i], 0.0)) * reach + EPSILON * terms:
            return False
        cut = max(cut, s.number[CUT, i] / norm)
        s.index[CHANGE, i] = DECIDED if state in (EQUAL, FREE) else OPEN
    return _ranks_are_clear(s, cut)


@inlined
def _ranks_are_clear(s, cut):
    """Whether no row would be dependent or not by an angle near the tolerance."""
    return (RANK_MARGIN * cut <= s.scalar[TOLERANCE] and cut <= CUT_OVER_PIVOT * s.scalar[PIVOT]
            and RANK_MARGIN * s.scalar[TOLERANCE] <= s.scalar[PIVOT]
            and s.scalar[PIVOT] * s.scalar[SECOND] >= PIVOT_PRODUCT)


@inlined
def _balances(s, p, reach):
    """Whether (2) and (3) hold for level p."""
    levels, mu = s.multiplier.shape[0] - 1, s.multiplier[p]
    begin = s.index[FIRST, p] if p < levels else s.A.shape[0]
    end = s.index[FIRST, p + 1] if p < levels else begin
    left, noise, n = s.number[GRADIENT], s.number[NOISE], s.x.size
    for c in range(n):
        left[c] = 0.0 if p < levels else s.x[c] - s.number[REFERENCE, c]
        noise[c] = CANCELLED * reach if p == levels else 0.0
    least, square, far, source = np.inf, 0.0, 0.0, 0.0
    for i in range(begin, end):
        if s.index[STATE, i] != FREE and s.number[NORM, i] > 0.0:
            norm = s.number[NORM, i]
            least, far = min(least, norm), max(far, abs(mu[i]))
            square += (mu[i] / norm) ** 2
            source = max(source, abs(mu[i]) * norm)
    if p < levels and far == 0.0:
        return True
    allowed = REMAINDER * reach
    if p < levels:
        missed = np.sqrt(square)
        if missed <= BAND * reach:
            return True
        allowed = REMAINDER * least * least * max(missed, reach) * s.scalar[PIVOT]
    rounding, turned = CANCELLED * reach if p == levels else 0.0, 0.0
    for i in range(end):
        if mu[i] != 0.0 and s.index[STATE, i] == FREE:
            return False
        if mu[i] != 0.0:
            rounding += CANCELLED * abs(mu[i]) * s.number[NORM, i]
            turned += 2.0 * s.number[CUT, i] * abs(mu[i])
            _add_row(s, mu[i], i)
    square = 0.0
    for c in range(n):
        square += max(abs(left[c]) - noise[c], 0.0) ** 2
    rest = np.sqrt(square)
    if not (rest <= allowed + turned
            and turned <= CUT_BALANCE * (reach if p == levels else source)):
        return False
    unsure = SIGN_MARGIN * (rest + rounding + turned) / s.scalar[PIVOT]
    for i in range(end):
        if mu[i] == 0.0 or s.index[CHANGE, i] == DECIDED:
            continue
        norm = s.number[NORM, i]
        if i >= begin and abs(mu[i]) <= NEGLIGIBLE * far + EPSILON * norm * reach:
            continue
        slight = min(norm * norm * reach, source) if i >= begin else source
        weak = abs(mu[i]) * norm <= max(unsure, CERTAIN_SIGN * slight if p < levels else 0.0)
        if mu[i] * s.index[STATE, i] < 0.0 and (s.index[CHANGE, i] == OPEN or not weak):
            return False
        s.index[CHANGE, i] = WEAKLY if weak else DECIDED
    return True


@inlined
def _add_row(s, f, i):
    """Add a multiple of row i of A to what is left, and its rounding to the noise."""
    a, c, left, noise = s.A[i], s.index[UNIT, i], s.number[GRADIENT], s.number[NOISE]
    least = CANCELLED * abs(f) * s.number[NORM, i]
    if c >= 0:
        left[c] += f * a[c]
        noise[c] += least
    else:
        for c in range(a.size):
            left[c] += f * a[c]
            noise[c] += least if a[c] != 0.0 else 0.0
