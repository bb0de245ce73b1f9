"""The search for the working set: rows enter and leave until the multipliers are right.

First, all rows that are wrong change at once (block pivoting), while their number falls. Then a
dual active set (Goldfarb, Idnani 1983, here over series in e, see `multipliers.py`): levels join
one at a time; the most violated row enters; where multipliers would change their sign, they move
towards those of the new working set until the first is zero, and that row leaves. Each accepted set
raises a strictly convex dual, so in exact arithmetic none recurs; where one does, rounding or cuts
decide, and the search ends.
"""

import numpy as np

from hierarchy.jit import inlined, internal
from solvers.kernels.active_set.multipliers import INWARD, UNDECIDED, write_multipliers
from solvers.kernels.active_set.verification import REFUTED, verify
from solvers.kernels.active_set.working_set import (
    BEGIN,
    CHANGE,
    DIRTY,
    FINISHED,
    FIRST,
    GOAL,
    HOLDS,
    KEPT,
    LIST,
    LOWER,
    NORM,
    SCRATCH,
    SEED,
    SEEN,
    SEEN_LAST,
    SIGN,
    SIZE,
    SOUND,
    STATE,
    UPPER,
    meet,
    restore,
    value_at,
)
from solvers.kernels.linalg.rows import length_of
from solvers.kernels.linalg.space import assign, fill
from solvers.kernels.tolerances import (
    EPSILON,
    NEGLIGIBLE,
    RECURRENCES,
    RESTORED,
    SHADOW,
    SLICE,
    SLICED,
    VIOLATED,
)
from solvers.status import EQUAL, FREE, INACCURATE, NUMERICAL_FAILURE, SOLVED, UNPROVED

LEAVES = 5    # change of a row that acts; else the side at which it is to act, or 0


@internal
def judge(s, last, newest):
    """Write the changes that a working set asks for in the first `last` levels.

    Returns the number of rows to change, of those to leave, and the most violated row, -1 for none.
    newest: a row that entered because it was violated, so that it pushes; -1 for none.
    """
    wrong, leaving, most, worst = 0, 0, -1, 0.0
    reach = length_of(s.x) + SHADOW * s.scalar[SIZE]
    fill(s.index[CHANGE], 0)
    for q in range(s.index[BEGIN, s.multiplier.shape[0] - 1]):
        i = s.index[LIST, q]
        if s.index[SIGN, q] == INWARD and i == newest:
            s.index[SIGN, q] = UNDECIDED
            fill(s.multiplier[:, i], 0.0)
        elif s.index[SIGN, q] == INWARD:
            s.index[CHANGE, i] = LEAVES
            leaving += 1
    for i in range(s.index[FIRST, last]):
        norm, low, up = s.number[NORM, i], s.number[LOWER, i], s.number[UPPER, i]
        if s.index[STATE, i] != FREE or norm <= 0.0:
            continue
        value = value_at(s, i)
        over = max(value - up, low - value)
        side = up if value > up else low
        if over > VIOLATED * (norm * reach + abs(side)):
            s.index[CHANGE, i] = 1 if value > up else -1
            wrong += 1
            if over > worst * norm:
                most, worst = i, over / norm
    return wrong + leaving, leaving, most


@inlined
def _points_inward(s):
    """Whether a row of the working set is to leave."""
    inward = False
    for q in range(s.index[BEGIN, s.multiplier.shape[0] - 1]):
        inward = inward or s.index[SIGN, q] == INWARD
    return inward


@internal
def pivot_in_blocks(s, limit, patience):
    """Change all wrong rows at once while their number falls; return the code and the tries.

    Where nothing else is wrong, the rows leave whose signs the verification refutes. SOLVED is
    verified; INACCURATE: nothing is wrong, but that is not verified; UNPROVED: the number does not
    fall, and the working set is the one that it began with, or with its x the last that violates
    nothing and is then SOUND. patience: tries that may not reduce it.
    """
    levels, best, left, tries = s.multiplier.shape[0] - 1, s.A.shape[0] + 1, patience, 0
    s.count[SOUND] = 0
    assign(s.index[SEED], s.index[STATE])
    while tries < limit:
        tries += 1
        meet(s, levels)
        write_multipliers(s)
        if not _points_inward(s):
            if verify(s, True):
                return SOLVED, tries
            for q in range(s.index[BEGIN, levels]):
                if s.index[CHANGE, s.index[LIST, q]] == REFUTED:
                    s.index[SIGN, q] = INWARD
        wrong, leaving, _ = judge(s, levels, -1)
        if wrong == 0:
            s.count[SOUND] = 0  # x is no longer that of an earlier set
            return INACCURATE, tries
        if wrong == leaving < s.index[BEGIN, levels]:
            _keep_sound(s)
        left = max(left, patience) if wrong < best else left - 1
        best = min(best, wrong)
        if left < 0:
            break
        _change(s, wrong, False)
    assign(s.index[STATE], s.index[SEED])
    if s.count[SOUND] == 1:
        assign(s.x, s.number[KEPT])
    return UNPROVED, tries


@inlined
def _keep_sound(s):
    """Keep the working set as SOUND, with its x, and from which level on each row is held.

    That is the level that it holds back, or an upper one in which another row is to leave.
    """
    s.count[SOUND] = 1
    assign(s.index[SEED], s.index[STATE])
    assign(s.number[KEPT, :s.x.size], s.x)
    changed = s.multiplier.shape[0]
    for i in range(s.A.shape[0]):
        k, leaves = 0, s.index[CHANGE, i] == LEAVES
        while k < s.multiplier.shape[0] and s.multiplier[k, i] == 0.0:
            k += 1
        changed = min(changed, k) if leaves else changed
        s.index[HOLDS, i] = -1 if leaves or s.index[STATE, i] == FREE else k
    for i in range(s.A.shape[0]):
        s.index[HOLDS, i] = min(s.index[HOLDS, i], changed)


@internal
def pivot_one_by_one(s, current, saved, limit, level):
    """Let rows enter and leave one by one; return the code, the iterations, the last level.

    SOLVED is verified; INACCURATE: nothing is wrong, but that is not verified.
    current (L + 1, m): scratch, the multipliers on the way. saved (n,): the x that met most levels.
    level: where earlier searches ended; its fraction counts those that did in this level. Where
    their limits are shorter than a step, single changes of the first wrong row come to an end all
    the same (Murty 1974), if slowly.
    """
    levels, last, newest, fresh = (
        s.multiplier.shape[0] - 1, _next_level(s, np.int64(max(level, 0.0))), -1, True)
    clean, accepted, tries, recurred, slices = 0, 0, 0, 0, level - np.floor(level)
    while tries < limit:
        tries += 1
        recurred = _count_recurrences(s, last, tries, recurred)
        if recurred > RECURRENCES:
            break
        meet(s, last)
        write_multipliers(s)
        wrong, leaving, most = judge(s, last, newest)
        if not np.isfinite(length_of(s.x)):
            return NUMERICAL_FAILURE, tries, last - 1.0
        if wrong > 0:
            _drop_rounding(s)
        if wrong > 0 and slices >= SLICED:
            _change(s, 1, False)
        elif leaving > 0 and fresh:
            _change(s, leaving, True)
        elif leaving > 0:
            _release_first(s, current)
        elif most >= 0:
            assign(s.index[SEED], s.index[STATE])
            _enter(s, current, most)
            newest, fresh, accepted = most, False, accepted + 1
        elif last < levels:
            save(s, saved, last)
            last, newest, fresh, slices = _next_level(s, last), -1, True, 0.0
        elif verify(s, True):
            return SOLVED, tries, last - 1.0
        elif s.count[DIRTY] == 1 and 1 < tries and clean < RESTORED:  # by other working sets too
            restore(s)
            newest, fresh, clean, recurred = -1, True, clean + 1, 0
        else:
            return INACCURATE, tries, last - 1.0
    if accepted > 1:  # go on later from the last accepted set; if this step is long, from within
        assign(s.index[STATE], s.index[SEED])
    return UNPROVED, tries, last - 1.0 + min(slices + SLICE, SLICED)


@inlined
def _count_recurrences(s, last, tries, recurred):
    """Return how often the working set of the last power of two of tries has come again since."""
    if tries & (tries - 1) == 0:
        s.count[SEEN_LAST] = last
        assign(s.index[SEEN], s.index[STATE])
        return 0
    same = s.count[SEEN_LAST] == last
    for i in range(s.A.shape[0] if same else 0):
        same = same and s.index[STATE, i] == s.index[SEEN, i]
    return recurred + same


@internal
def save(s, saved, finished):
    """Keep x if it meets more levels than the one kept."""
    if finished > s.count[FINISHED]:
        s.count[FINISHED] = finished
        assign(saved, s.x)


@inlined
def _next_level(s, last):
    """Return the number of levels with one more that has rows."""
    levels = s.multiplier.shape[0] - 1
    last += last < levels
    while last < levels and s.index[FIRST, last] == s.index[FIRST, last - 1]:
        last += 1
    return last


@inlined
def _drop_rounding(s):
    """Make violations zero that decide no sign: else rounding begins the series of a row."""
    reach = length_of(s.x) + SHADOW * s.scalar[SIZE]
    for k in range(s.multiplier.shape[0] - 1):
        most, mu = 0.0, s.multiplier[k]
        for i in range(s.index[FIRST, k], s.index[FIRST, k + 1]):
            most = max(most, abs(mu[i]))
        for i in range(s.index[FIRST, k], s.index[FIRST, k + 1]):
            if (s.index[STATE, i] != EQUAL
                    and abs(mu[i]) <= NEGLIGIBLE * most + EPSILON * s.number[NORM, i] * reach):
                mu[i] = 0.0


@inlined
def _change(s, count, leave):
    """Change the first rows that are wrong, so many of them; `leave`: of those that are to."""
    for i in range(s.A.shape[0]):
        change = s.index[CHANGE, i]
        if count > 0 and change != 0 and (change == LEAVES or not leave):
            s.index[STATE, i] = FREE if change == LEAVES else change
            count -= 1


@inlined
def _enter(s, current, newest):
    """Let a row enter, and keep the multipliers from which it does."""
    for p in range(current.shape[0]):
        assign(current[p], s.multiplier[p])
    s.index[STATE, newest] = s.index[CHANGE, newest]


@inlined
def _release_first(s, current):
    """Move the multipliers towards those of the working set until one is zero; that row leaves."""
    levels, k, blocking = s.multiplier.shape[0] - 1, 0, -1
    share, other = s.number[GOAL, :levels + 1], s.number[SCRATCH, :levels + 1]
    for q in range(s.index[BEGIN, levels]):
        while s.index[BEGIN, k + 1] <= q:
            k += 1
        if s.index[SIGN, q] == INWARD:
            i = s.index[LIST, q]
            _write_share(current[:, i], s.multiplier[:, i], k, other)
            if blocking < 0 or _is_less(other, share):
                blocking = i
                assign(share, other)
    k = 0
    for q in range(s.index[BEGIN, levels]):
        while s.index[BEGIN, k + 1] <= q:
            k += 1
        i = s.index[LIST, q]
        for p in range(levels, k - 1, -1):
            change = 0.0
            for j in range(p - k + 1):
                change += share[j] * (s.multiplier[p - j, i] - current[p - j, i])
            current[p, i] += change
    s.index[STATE, blocking] = FREE
    fill(current[:, blocking], 0.0)


@inlined
def _write_share(current, target, k, share):
    """Write the share of the way, a series in e, at which a row of level k has nothing left."""
    size, changed = current.size, k
    while changed < size and current[changed] == target[changed]:
        changed += 1
    for j in range(size):
        share[j] = 0.0
        if changed + j < size:
            left = current[changed + j]
            for i in range(j):
                left -= share[i] * (current[changed + j - i] - target[changed + j - i])
            share[j] = left / (current[changed] - target[changed])


@inlined
def _is_less(one, other):
    """Whether a series in e is less than another: the first term that differs decides."""
    j = 0
    while j < one.size - 1 and one[j] == other[j]:
        j += 1
    return one[j] < other[j]
