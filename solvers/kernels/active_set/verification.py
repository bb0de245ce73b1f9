"""Verification of an answer on the data: the solver's one look at optimality.

The claims are x, the side at which each row acts, and the multipliers of each level. x is optimal,
and the nearest to the reference, if

    each row that does not act lies within its sides, each other one at its side, beyond it by the
    violation claimed in its own level;                                                         (1)
    sum_i mu_pi a_i = 0 over the rows of the levels up to p, for each level p that is missed, and
    x - reference + sum_i mu_Li a_i = 0;                                                        (2)
    the first multiplier of each acting inequality that is not zero points outward.             (3)

What is left of (1) is a shift of sides, held against its own row. What is left of (2) is made one
where rounding exceeds a turn of the rows of level p, which is held against the row of least norm: a
heavy row excuses no light one. So SOLVED says: x is exactly optimal for a problem this close to the
data.

The large multipliers of nearly parallel rows may round off by more than such a turn. Multipliers
that balance exactly exist all the same, where the rows are independent, and are this close: then no
sign may hang on the difference, and no row be off its side by more than rounding and forgiven, as
the large multipliers say by how far that moves x.
"""

from collections import namedtuple

import numpy as np

from hierarchy.jit import inlined, internal
from solvers.kernels.active_set.multipliers import refine
from solvers.kernels.active_set.working_set import (
    BEGIN,
    CHANGE,
    CUT,
    FIRST,
    GRADIENT,
    LIST,
    LOWER,
    NEGLECTED,
    NOISE,
    NORM,
    PIVOT,
    RANK,
    REFERENCE,
    SCRATCH,
    SECOND,
    SHORT,
    STATE,
    TOLERANCE,
    UNIT,
    UPPER,
    WHOLE,
    product_with,
)
from solvers.kernels.linalg.rows import length_of
from solvers.kernels.linalg.space import fill
from solvers.kernels.tolerances import (
    BAND,
    CANCELLED,
    CLEAR_MISS,
    CUT_BALANCE,
    EPSILON,
    FAINT,
    FREE_ROWS,
    HEAVIER,
    KNOWN_MULTIPLIER,
    MET,
    NEGLIGIBLE,
    PIVOT_PRODUCT,
    RANK_MARGIN,
    REMAINDER,
    ROUNDING_BALANCE,
    SIGN_MARGIN,
    SIGN_ROUNDING,
)
from solvers.status import EQUAL, FREE

# What is known of an inequality that acts: nothing, a weak multiplier decided, decided, or that the
# level that fails points it inward.
OPEN, WEAKLY, DECIDED, REFUTED = range(4)


@internal
def verify(s, factored):
    """Whether the claims of a working set prove its x.

    factored: whether `meet` has factored this set, so that its multipliers can be refined. Rows
    whose multipliers have the wrong sign are then REFUTED in CHANGE.
    """
    levels, whole = s.multiplier.shape[0] - 1, s.count[WHOLE]
    reach = 1.0 + length_of(s.x)
    fill(s.index[CHANGE], OPEN)  # whatever ends this early refutes nothing
    if not np.isfinite(reach) or not _rows_hold(s, reach):
        return False
    proved = True
    for p in range(levels + 1 if whole < 0 else whole + 1):
        proved = proved and _balances(s, p, reach, factored)
    return proved


@internal
def neglects(s):
    """Whether x violates a row that is ignored because rows of other levels are far larger."""
    missed, reach = False, 1.0 + length_of(s.x)
    for i in range(s.A.shape[0] if s.count[NEGLECTED] > 0 else 0):
        value = product_with(s, i, s.x)
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
        norm = s.number[NORM, i]
        if norm <= 0.0:
            continue
        if not _row_holds(s, k, i, reach):
            return False
        cut = max(cut, s.number[CUT, i] / norm)
        if s.index[STATE, i] in (EQUAL, FREE):
            s.index[CHANGE, i] = DECIDED
    # No row would be dependent or not by an angle near the tolerance.
    return (RANK_MARGIN * cut <= s.scalar[TOLERANCE] <= s.scalar[PIVOT] / RANK_MARGIN
            and s.scalar[PIVOT] * s.scalar[SECOND] >= PIVOT_PRODUCT)


@inlined
def _row_holds(s, k, i, reach):
    """Whether (1) holds for row i of level k."""
    value, low, up = product_with(s, i, s.x), s.number[LOWER, i], s.number[UPPER, i]
    side, state = low if s.index[STATE, i] < 0 else up, s.index[STATE, i]
    if state == FREE:
        beyond, terms = max(value - up, low - value) * FREE_ROWS, abs(value)
    else:
        beyond, terms = abs(value - side - s.multiplier[k, i]), abs(value) + abs(side)
    shift = BAND * s.number[NORM, i] + s.number[CUT, i]
    return beyond <= shift * reach + EPSILON * terms


Level = namedtuple("Level", "p begin end least far missed source unsure")
"""A level p to verify: its rows, and what they have in common.

least: the norm of the lightest row that acts. far: the largest violation. missed: the length of
all, each over the norm of its row. source: the largest violation times the norm of its row.
unsure: what rounding of the largest may be in the force of the heaviest row.
"""


@inlined
def _balances(s, p, reach, factored):
    """Whether (2) and (3) hold for level p, for the rows as cut; no sign hangs on what was cut."""
    last = p == s.multiplier.shape[0] - 1
    level, ends = _measured(s, p, last), last or p == s.count[WHOLE]
    met = not last and level.missed <= BAND * reach
    if met and level.missed == 0.0:
        return True
    source, allowed = (reach if last else level.source), REMAINDER * reach
    if not last:
        allowed = REMAINDER * level.least * level.least * level.missed
    # Else heavy rows may round off a light one; small pivots enlarge that.
    clear = SIGN_ROUNDING * source <= allowed * (1.0 if ends else s.scalar[PIVOT])
    if not (clear or factored):
        return met
    outside, rounding, turned, signed = _add_rows(s, level, reach if last else 0.0)
    if signed or not ends:  # rows with small pivots can make good what is left
        allowed = min(allowed, KNOWN_MULTIPLIER * source * s.scalar[PIVOT])
    rest = _beyond_rounding(s)
    if factored and not rest <= allowed:
        refine(s, p)
        outside, rounding, turned, signed = _add_rows(s, level, reach if last else 0.0)
        rest = _beyond_rounding(s)
        for i in range(level.begin, level.end):
            outside = outside or (s.number[NORM, i] > 0.0 and not _row_holds(s, p, i, reach))
    exact = not signed or rounding <= ROUNDING_BALANCE * source
    holds = (not outside and rest <= allowed and (clear or _is_clear(s, level, reach))
             and turned <= CUT_BALANCE * source
             and rounding <= (CUT_BALANCE if signed else KNOWN_MULTIPLIER) * source
             and (exact or (factored and _sides_are_clear(s, reach))))
    left = length_of(s.number[GRADIENT, :s.x.size])
    error = (SIGN_MARGIN * (left + rounding) + level.unsure) / s.scalar[PIVOT]
    cut = SIGN_MARGIN * turned / s.scalar[PIVOT]
    unsure = min(error + cut, KNOWN_MULTIPLIER * source) if exact else 0.0
    if holds and _signs_hold(s, level, unsure, reach, allowed, met):
        if level.missed > CLEAR_MISS * s.scalar[TOLERANCE] * reach:
            # What is cut from a row lies beyond the columns of those that act: no pivot there
            # makes it larger.
            cut = min(cut, SIGN_MARGIN * turned)
        return _decide(s, level, error, cut, reach, exact) or met
    return met


@inlined
def _sides_are_clear(s, reach):
    """Whether no row is off its side by more than rounding, but so little that it is forgiven."""
    clear = True
    for i in range(s.A.shape[0]):
        value, low, up = product_with(s, i, s.x), s.number[LOWER, i], s.number[UPPER, i]
        beyond, scale = max(value - up, low - value), s.number[NORM, i] * reach
        clear = clear and not MET * scale < beyond <= BAND * scale
    return clear


@inlined
def _is_clear(s, level, reach):
    """Whether no row rounds off the force of a far lighter one, in the column of this one.

    Where pivots are small, a row has rounding there even if its entry is zero.
    """
    clear, begin, end = True, s.index[BEGIN, level.p], s.index[BEGIN, level.p + 1]
    above, norms = s.index[RANK, level.p], s.number[NORM]
    rough = CANCELLED * s.scalar[PIVOT] < SIGN_ROUNDING
    for t in range(above, s.index[RANK, level.p + 1]):
        own = begin + t - above
        norm, force = norms[s.index[LIST, own]], 0.0
        for q in range(begin, end):
            i = s.index[LIST, q]
            if (s.W[q, t] != 0.0 or rough) and norms[i] > HEAVIER * norm:
                force += abs(s.multiplier[level.p, i]) * norms[i]
        clear = clear and (SIGN_ROUNDING * force
                           <= REMAINDER * max(level.missed, reach) * norm * abs(s.W[own, t]))
    return clear


@inlined
def _measured(s, p, last):
    """Return a `Level`."""
    begin = s.index[FIRST, p] if not last else s.A.shape[0]
    end = s.index[FIRST, p + 1] if not last else begin
    least, most, square, far, source = np.inf, 0.0, 0.0, 0.0, 0.0
    for i in range(begin, end):
        if s.index[STATE, i] != FREE and s.number[NORM, i] > 0.0:
            norm, miss = s.number[NORM, i], abs(s.multiplier[p, i])
            least, most, far = min(least, norm), max(most, norm), max(far, miss)
            source = max(source, miss * norm)
            square += (miss / norm) ** 2
    return Level(p, begin, end, least, far, np.sqrt(square), source, SIGN_ROUNDING * far * most)


@inlined
def _add_rows(s, level, reach):
    """Write the sum of the rows times their multipliers, and per unknown what may be rounding.

    reach: of x, for the level of the reference, else 0. Returns whether a row has a multiplier
    that does not act, the rounding of the sum, what the cuts of rows add to it, and whether a
    multiplier needs a sign.
    """
    mu, outside, rounding, turned = s.multiplier[level.p], False, SIGN_ROUNDING * reach, 0.0
    signed, k, cut, most = False, 0, 0.0, 0.0
    for c in range(s.x.size):
        s.number[GRADIENT, c] = s.x[c] - s.number[REFERENCE, c] if reach > 0.0 else 0.0
        s.number[NOISE, c] = CANCELLED * reach
    for i in range(level.end):
        while i >= s.index[FIRST, k + 1]:
            turned, k, cut, most = turned + 2.0 * cut * most, k + 1, 0.0, 0.0
        cut, most = max(cut, s.number[CUT, i]), max(most, abs(mu[i]))
        if mu[i] != 0.0:
            state = s.index[STATE, i]
            outside, signed = outside or state == FREE, signed or state != EQUAL
            rounding += SIGN_ROUNDING * abs(mu[i]) * s.number[NORM, i]
            _add_row(s, mu[i], i)
    turned += 2.0 * cut * most
    return outside, rounding, turned, signed


@inlined
def _beyond_rounding(s):
    """Return the length of the gradient beyond what may be rounding."""
    square = 0.0
    for c in range(s.x.size):
        square += max(abs(s.number[GRADIENT, c]) - s.number[NOISE, c], 0.0) ** 2
    return np.sqrt(square)


@inlined
def _signs_hold(s, level, unsure, reach, allowed, met):
    """Whether no multiplier of level p points inward for a row that nothing has decided.

    unsure: those below it decide weakly. allowed: what may remain of the gradient, also where an
    inward violation counts as zero. met: whether the level is, which then refutes no sign.
    """
    mu, holds = s.multiplier[level.p], True
    for i in range(level.end):
        pull = abs(mu[i]) * s.number[NORM, i]
        if mu[i] * s.index[STATE, i] < 0.0 and not (
                _is_rounding(s, level, i, reach) and pull <= allowed):
            decided = s.index[CHANGE, i]
            if decided == OPEN or (decided == WEAKLY and pull > unsure):
                s.index[CHANGE, i], holds = decided if met else REFUTED, False
    return holds


@inlined
def _decide(s, level, error, cut, reach, exact):
    """Note for each row how far level p decides its sign; False if what is cut may decide one.

    Or, unless the balance is `exact`, rounding.
    """
    clear = True
    for i in range(level.end):
        if s.index[CHANGE, i] != DECIDED and not _is_rounding(s, level, i, reach):
            mu, own, unsure = abs(s.multiplier[level.p, i]), i >= level.begin, error
            force = mu * s.number[NORM, i]
            if not (exact or own) and force <= error:
                unsure *= s.scalar[PIVOT] * _leverage(s, i, level.p)
            weak = force <= unsure + cut
            clear = clear and not (weak and (force > unsure or not (exact or own)))
            # Entries of rows are unsure, and with them the least of the violations.
            faint = own and mu <= FAINT * level.far
            s.index[CHANGE, i] = WEAKLY if weak or faint else DECIDED
    return clear


@inlined
def _leverage(s, i, last):
    """Return the force of row i that balances a gradient of 1, at most; inf if not known.

    It is one over the sine of the angle of row i to the other rows of the levels before `last`:
    the smallest pivot may be that of others.
    """
    y, square = s.number[SCRATCH], 0.0
    for k in range(last):
        first, above, rank = s.index[BEGIN, k], s.index[RANK, k], s.index[RANK, k + 1]
        spare = s.index[BEGIN, k + 1] - first > rank - above
        for t in range(above, rank):
            q, here = first + t - above, s.index[LIST, first + t - above] == i
            y[t] = s.number[NORM, i] if here else 0.0
            for c in range(t):
                y[t] -= s.W[q, c] * y[c]
            y[t] /= s.W[q, t]
            square += np.inf if s.index[SHORT, k] == 1 or (here and spare) else y[t] ** 2
    return np.sqrt(square) if square > 0.0 else np.inf


@inlined
def _is_rounding(s, level, i, reach):
    """Whether a row has no multiplier in level p."""
    mu = abs(s.multiplier[level.p, i])
    return mu == 0.0 or (i >= level.begin and mu <= NEGLIGIBLE * level.far
                         + EPSILON * s.number[NORM, i] * reach)


@inlined
def _add_row(s, f, i):
    """Add a multiple of row i, as cut, to what is left, and its rounding to the noise."""
    a = s.C[i] if s.number[CUT, i] > 0.0 else s.A[i]
    c, left, noise = s.index[UNIT, i], s.number[GRADIENT], s.number[NOISE]
    least = CANCELLED * abs(f) * s.number[NORM, i]
    if c >= 0:
        left[c] += f * a[c]
        noise[c] += least
    else:
        for c in range(a.size):
            left[c] += f * a[c]
            noise[c] += least if a[c] != 0.0 else 0.0
