"""Proof of an answer by its multipliers: the conditions of Karush, Kuhn and Tucker, from the data.

A resolver claims x, and which rows on their sides hold which level back; where it is mistaken about
the rows, they are changed. With u = a / |a| and the misses t as lengths, level k is optimal if

    sum_i |a_i|^2 t_i u_i + sum_j lambda_j u_j = 0                                              (1)

over its own rows i that are equalities or missed, and over rows j above: equalities and missed rows
with any lambda_j, rows claimed to hold level k back with lambda_j pointing outward. Rows that hold
back a level above may have any sign as well, because a multiple of that level's (1) can be added.
With x - reference in place of the first sum, (1) proves that x is the nearest.

The multipliers come from a factorisation made here, and what remains of (1) is summed over the rows
themselves, so the proof rests on the data alone. It needs every equality and missed row to be
clearly inside the span of others or clearly outside, and no multiplier so large that together the
rows are nearly dependent: `certify`, which takes fifty times as long, judges all else.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hierarchy.jit import as_matrix, compiled, inlined
from solvers.kernels.rows import ZERO, add_multiple, has_outlier, make_reflector, reflect
from solvers.kernels.space import (
    Basis,
    View,
    carve_basis,
    integers,
    matrix,
    proof_size,
    vector,
)
from solvers.kernels.tableau import REFERENCE, length_of
from solvers.kernels.tolerances import (
    ALONE,
    BAND,
    CLEAR,
    DUST,
    ENOUGH,
    EPSILON,
    EXCHANGED,
    FORGIVEN,
    LARGEST,
    NOTHING,
    SAME,
    UNIT,
)
from solvers.status import INACCURATE, SOLVED, TOO_SMALL

# Rows of `number`. Per row of A: its norm, its miss, +1 or -1 for the side of an inequality that it
# is on; the squared remainder of each column of M. Per unknown: what remains of (1), in x and in
# the basis.
NORM, MISS, SIDE, SQUARE, LEFT, Z = range(6)
# Rows of `index`. Per row of A: when it joins, 2 k if it holds level k back, 2 k + 1 if it is an
# equality or missed in level k, -1 for never. Per column of M: its row. Per basis vector: its
# column. Per level: where the columns of its two groups end, and the basis vectors of each.
JOINS, ROW, OWNER, HELD, OWN, HELD_RANK, OWN_RANK = range(7)

HOLDS, LACKS, EXCEEDS, UNCLEAR = range(4)  # what is found of (1)
REFINEMENTS = 3
CHANGES = 6  # of what a record claims, at most
TINY, HUGE = 1e-100, 1e100  # norms whose powers neither underflow nor overflow


class Proof(NamedTuple):
    """The data of a proof.

    A (m, n), x (n,). number, index (.., w), w the largest of m, n, L + 1: see above. force
    (L + 1, n): the multipliers of each level, by basis vector. rest (L + 1,): what remains of (1).
    basis: reflectors. M (n, g): the g unit rows that join, as columns in that order, in the basis.
    room: scratch.
    """

    A: View
    x: View
    number: View
    index: View
    force: View
    rest: View
    basis: Basis
    M: View
    room: View


@inlined
def settle(s, lower, upper, sizes, record, code):
    """Return the code of a solve: SOLVED in place of INACCURATE if its record proves x."""
    if code != INACCURATE:
        return code
    return prove_by_multipliers(s.A, lower, upper, sizes, s.x,
                                s.number[REFERENCE, :s.x.size], record, s.room)


@compiled
def prove_by_multipliers(A, lower, upper, sizes, x, reference, record, work):
    """Return SOLVED if x (n,) is proved to be the answer, INACCURATE if not, or TOO_SMALL.

    reference (n,). record (3 m + 3,): that of an exact solve, of which the state of each row and
    the level that it holds back are read. A solver mistakes weak multipliers: a few rows are
    added to its claims where a level lacks one, or removed where they point inward.
    """
    p, enough = _carve(A, sizes, x, work)
    if not enough:
        return ZERO + TOO_SMALL
    reach = _place(p, lower, upper, sizes, record)
    if not reach < HUGE or has_outlier(p.number[NORM, :A.shape[0]], DUST):
        return ZERO + INACCURATE
    for _ in range(CHANGES + 1):
        whole = _with_columns(p, sizes.size)
        k, found = _first_unproved(whole, reference, reach)
        if found == HOLDS:
            return ZERO + SOLVED
        if found == UNCLEAR or (found == LACKS and not _claim(whole, sizes, k)):
            break
    return ZERO + INACCURATE


@compiled
def _first_unproved(p, reference, reach):
    """Return the first level that is not proved and what is found of it; HOLDS if there is none."""
    rank, left = ZERO, 0.0
    for k in range(p.rest.size):
        begin, held, own = _begin(p, OWN, k), p.index[HELD, k], p.index[OWN, k]
        rank += _join(p, begin, held, rank)[0]  # the others are not needed
        p.index[HELD_RANK, k] = rank
        independent, beyond = _join(p, held, own, rank)
        p.index[OWN_RANK, k] = rank = rank + independent
        if beyond > NOTHING:
            return ZERO + k, UNCLEAR
        found = _balance(p, reference, k, left, reach)
        left = max(left, beyond)
        if found != HOLDS:
            return ZERO + k, found
    return p.rest.size, HOLDS


@inlined
def _claim(p, sizes, k):
    """Claim that a row on its side holds level k back, or two; return whether there is one.

    The first is that along what remains of (1), the second that along what remains then.
    """
    above, before = ZERO, _length(p)
    for level in range(min(k, sizes.size)):
        above += sizes[level]
    for count in range(2):
        i, push = _most_outward(p, k, above)
        square = _square_outside(p, i, p.index[HELD_RANK, k]) if i >= 0 else 0.0
        if square < CLEAR * CLEAR:
            return count > 0
        p.index[JOINS, i] = 2 * k
        share = p.number[SIDE, i] * push / (square * p.number[NORM, i])
        add_multiple(p.number[LEFT, :p.x.size], share, p.A[i])
        _push(p, p.force[k], p.index[HELD_RANK, k])
        if _length(p) < ALONE * before:
            break
    return True


@inlined
def _most_outward(p, k, above):
    """Return the row along what remains of (1) that may be claimed, -1 if none, and its push."""
    best, most = -1, 0.0
    for i in range(above):
        if p.number[SIDE, i] == 0.0 or 0 <= p.index[JOINS, i] <= 2 * k + 1:
            continue
        push = 0.0
        for c in range(p.x.size):
            push -= p.A[i, c] * p.number[LEFT, c]
        push *= p.number[SIDE, i] / p.number[NORM, i]
        if push > most:
            best, most = i, push
    return best, most


@inlined
def _square_outside(p, i, rank):
    """Return the square of what is left of a unit row outside the first `rank` basis vectors."""
    z, square = p.number[Z], 0.0
    for c in range(p.x.size):
        z[c] = p.A[i, c] / p.number[NORM, i]
    reflect(p.basis, ZERO, rank, p.number, Z, Z + 1)
    for c in range(rank, p.x.size):
        square += z[c] * z[c]
    return square


@inlined
def _carve(A, sizes, x, work):
    """Return a Proof whose M has no columns yet, and whether everything fits."""
    m, n = A.shape
    levels, enough = sizes.size + 1, proof_size(n, m, sizes.size) <= work.size
    w = max(m, n, levels)
    number, at = matrix(work, ZERO, 6, w)
    numbers, at = integers(work, at, 7 * w)
    force, at = matrix(work, at, levels, n)
    rest, at = vector(work, at, levels)
    basis, at = carve_basis(work, at, n, n)
    room = work[at if enough else work.size:]
    return Proof(A, x, number, as_matrix(numbers, 7 if numbers.size > 0 else 0, w), force, rest,
                 basis, as_matrix(room[:0], n, 0), room), enough


@inlined
def _begin(p, ends, k):
    """Return where the level after k - 1 begins, given the row of `index` with the ends."""
    return p.index[ends, k - 1] if k > 0 else ZERO


@inlined
def _place(p, lower, upper, sizes, record):
    """Write norms, misses and when each row joins; return 1 + |x|, inf if a norm is unusual."""
    reach, i = 1.0 + length_of(p.x), ZERO
    for k in range(sizes.size):
        for _ in range(sizes[k]):
            value = norm = largest = 0.0
            for c in range(p.x.size):
                entry = p.A[i, c]
                value += entry * p.x[c]
                norm += entry * entry
                largest = max(largest, abs(entry))
            norm = np.sqrt(norm)
            if largest > 0.0 and not TINY < norm < HUGE:
                reach = np.inf
            p.number[NORM, i], p.index[JOINS, i] = norm, -1
            p.number[SIDE, i] = 0.0
            if largest > 0.0:
                _place_row(p, i, k, value, (lower[i], upper[i], BAND * reach * norm), record)
            i += 1
    return reach


@inlined
def _place_row(p, i, k, value, sides, record):
    """Write the miss of row i of level k and when it joins; sides: both, and the width at each."""
    low, up, band = sides
    miss = max(value - up, 0.0) - max(low - value, 0.0)
    claimed, level = abs(record[i]) == 1.0, np.int64(record[p.A.shape[0] + i])
    side = 1.0 if abs(value - up) <= band else -1.0 if abs(value - low) <= band else 0.0
    if claimed and abs(value - (up if record[i] > 0.0 else low)) <= band:
        side = record[i]
    p.number[MISS, i], p.number[SIDE, i] = miss / p.number[NORM, i], side
    if low == up or abs(miss) > band:
        p.index[JOINS, i], p.number[SIDE, i] = 2 * k + 1, 0.0
    elif claimed and level > k and side == record[i]:
        p.index[JOINS, i] = 2 * level


@inlined
def _with_columns(p, levels):
    """Return the Proof with the unit rows as columns, in the order in which they join."""
    m, n = p.A.shape
    at = ZERO
    for group in range(2 * levels + 2):
        for i in range(m):
            if p.index[JOINS, i] == group:
                p.index[ROW, at] = i
                at += 1
        p.index[HELD if group % 2 == 0 else OWN, group // 2] = at
    M, end = matrix(p.room, ZERO, n, at)
    for q in range(at):
        i = p.index[ROW, q]
        a, share = p.A[i], 1.0 / p.number[NORM, i]
        for c in range(a.size):
            M[c, q] = share * a[c]
    return Proof(p.A, p.x, p.number, p.index, p.force, p.rest, p.basis, M, p.room[end:])


@compiled
def _join(p, begin, end, rank):
    """Give the columns begin .. end - 1 basis vectors from `rank` on, the largest remainder first.

    Returns how many got one, and the largest remainder of the others.
    """
    n, at, left = p.x.size, begin, 0.0
    while at < end and rank < n:
        best = _largest(p, at, end, rank)
        left = np.sqrt(p.number[SQUARE, best])
        if not left >= CLEAR:
            break
        _swap(p, at, best)
        _eliminate(p, rank, at, p.number[SQUARE, best])
        p.index[OWNER, rank] = at
        rank, at, left = rank + 1, at + 1, 0.0
    return at - begin, left


@inlined
def _largest(p, begin, end, rank):
    """Return which of the columns begin .. end - 1 has the largest remainder; write the squares."""
    square, best = p.number[SQUARE, begin:end], 0
    for q in range(square.size):
        square[q] = 0.0
    for t in range(rank, p.x.size):
        row = p.M[t, begin:end]
        for q in range(square.size):
            square[q] += row[q] * row[q]
    for q in range(square.size):
        if square[q] > square[best]:
            best = q
    return begin + best


@inlined
def _swap(p, q, r):
    """Swap two columns."""
    for t in range(p.x.size):
        p.M[t, q], p.M[t, r] = p.M[t, r], p.M[t, q]
    p.index[ROW, q], p.index[ROW, r] = p.index[ROW, r], p.index[ROW, q]


@inlined
def _eliminate(p, k, q, square):
    """Make reflector k, which leaves column q nothing below row k; apply it to the columns after q.

    By rows of M, so that all columns are summed at once. square: that of column q from row k on.
    """
    M, v, after = p.M, p.basis.V[k], q + 1
    make_reflector(p.basis, k, M[:, q], square)
    M[k, q] = -np.sqrt(square) if M[k, q] >= 0.0 else np.sqrt(square)
    sums = p.room[:M.shape[1] - after]
    for c in range(sums.size):
        sums[c] = 0.0
    for t in range(k, p.x.size):
        add_multiple(sums, v[t], M[t, after:])
    for t in range(k, p.x.size):
        add_multiple(M[t, after:], -p.basis.beta[k] * v[t], sums)


@inlined
def _balance(p, reference, k, left, reach):
    """Return HOLDS if the rows of level k are met or (1) holds for it; writes its multipliers.

    Else LACKS if a row may be missing, EXCEEDS if one pointed inward and is no longer claimed, or
    UNCLEAR. What the rows above leave may also be balanced by small shifts of the level's sides.
    left: the largest remainder of a dependent row above, which such a row would leave of (1), times
    its multiplier, in place of one that it depends on.
    """
    force, levels, held = p.force[k], p.rest.size - 1, p.index[HELD_RANK, k]
    for t in range(p.x.size):
        force[t] = p.number[LEFT, t] = 0.0
    enough = _pull(p, k, reach) if k < levels else _pull_of_goal(p, reference, reach)
    p.rest[k] = 0.0
    if enough == 0.0:
        return HOLDS
    pull = _length(p)
    for _ in range(REFINEMENTS):  # each sums anew what remains, so the last digits come right too
        _push(p, force, held)
        if _length(p) <= EPSILON * pull:
            break
    if _length(p) > 0.1 * enough:
        own = p.index[OWN_RANK, k]
        _push(p, force, own)
        if _shift(p, force, held, own) > ENOUGH * reach:
            _drop(p, force, held, own)
            _push(p, force, held)  # those above were changed together with them
    inward = _turn_back(p, force, _begin(p, OWN_RANK, k), held, enough)
    rest, largest = _length(p), _largest_of(force, held)
    lost = rest <= UNIT * (pull + _sum_of(force))  # to rounding, which multiples amplify
    p.rest[k] = FORGIVEN * rest if lost else rest
    if not largest <= LARGEST * pull or left * largest > EXCHANGED * enough:
        return UNCLEAR  # together the rows are nearly dependent
    if rest > enough:
        return EXCEEDS if inward else LACKS
    return HOLDS if _signs_hold(p, force, k) and p.rest[k] <= enough else UNCLEAR


@inlined
def _largest_of(force, end):
    """Return the largest of the first forces."""
    largest = 0.0
    for t in range(end):
        largest = max(largest, abs(force[t]))
    return largest


@inlined
def _sum_of(force):
    """Return the sum of the absolute forces."""
    total = 0.0
    for t in range(force.size):
        total += abs(force[t])
    return total


@inlined
def _drop(p, force, begin, end):
    """Set forces to zero."""
    for t in range(begin, end):
        _add(p, t, -force[t])
        force[t] = 0.0


@inlined
def _turn_back(p, force, begin, end, enough):
    """Set forces to zero that point inward; whether one did, by more than enough.

    Such a row is no longer claimed.
    """
    inward = False
    for t in range(begin, end):
        if force[t] * p.number[SIDE, _row(p, t)] < 0.0:
            if abs(force[t]) > enough:
                p.index[JOINS, _row(p, t)], inward = -1, True
            _drop(p, force, t, t + 1)
    return inward


@inlined
def _shift(p, force, begin, end):
    """Return the length of the shifts of sides that these forces amount to."""
    square = 0.0
    for t in range(begin, end):
        square += (force[t] / p.number[NORM, _row(p, t)] ** 2) ** 2
    return np.sqrt(square)


@inlined
def _pull(p, k, reach):
    """Write the first sum of (1) for level k; return what may remain of it, 0 if rows are met."""
    left, square, least = p.number[LEFT], 0.0, np.inf
    for q in range(p.index[HELD, k], p.index[OWN, k]):
        i = p.index[ROW, q]
        norm, miss = p.number[NORM, i], p.number[MISS, i]
        square += miss * miss
        least = min(least, norm)
        for c in range(p.x.size if miss != 0.0 else 0):
            left[c] += norm * miss * p.A[i, c]
    length = np.sqrt(square)
    if length <= 0.1 * BAND * reach:
        return 0.0
    return least * least * ENOUGH * length


@inlined
def _pull_of_goal(p, reference, reach):
    """Write x - reference; return the same as `_pull`."""
    for c in range(p.x.size):
        p.number[LEFT, c] = p.x[c] - reference[c]
    return ENOUGH * reach


@inlined
def _length(p):
    """Return the length of what remains of (1)."""
    return length_of(p.number[LEFT, :p.x.size])


@inlined
def _row(p, t):
    """Return the row that owns basis vector t."""
    return p.index[ROW, p.index[OWNER, t]]


@inlined
def _add(p, t, force):
    """Add a force along the unit row of basis vector t to what remains of (1)."""
    i, left = _row(p, t), p.number[LEFT]
    a, share = p.A[i], force / p.number[NORM, i]
    for c in range(a.size):
        left[c] += share * a[c]


@compiled
def _push(p, force, rank):
    """Change the forces of the first `rank` basis vectors so that nothing remains in their span."""
    M, z = p.M, p.number[Z]
    for c in range(p.x.size):
        z[c] = p.number[LEFT, c]
    reflect(p.basis, ZERO, rank, p.number, Z, Z + 1)
    for t in range(rank - 1, -1, -1):
        q = p.index[OWNER, t]
        change = -z[t] / M[t, q]
        force[t] += change
        for c in range(t):
            z[c] += change * M[c, q]
        _add(p, t, change)


@inlined
def _signs_hold(p, force, k):
    """Whether rows that hold back a level above k point outward, with a multiple of its (1) added.

    Adds what remains of that to the rest of level k.
    """
    for above in range(k - 1, -1, -1):
        begin, end = _begin(p, OWN_RANK, above), p.index[HELD_RANK, above]
        share, least = 0.0, SAME * _largest_of(p.force[above], end)
        for t in range(begin, end):
            side, given = p.number[SIDE, _row(p, t)], p.force[above, t]
            if force[t] * side < 0.0:
                share = max(share, -force[t] / given) if given * side > least else np.inf
        if share == np.inf:
            return False
        for t in range(end if share > 0.0 else 0):
            force[t] += share * p.force[above, t]
        p.rest[k] += share * p.rest[above]
    return True
