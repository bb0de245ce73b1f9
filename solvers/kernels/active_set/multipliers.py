"""Multipliers of a working set: what each row holds back in each level, and with which sign.

The answer is the limit, for e to 0, of the minimiser of sum_k e^k |v_k|^2 + e^L |x - reference|^2,
v_k the violations of level k. There the violation of a row is a series in e: its own violation,
then its multipliers in the levels below, then that of the distance to the reference. A row belongs
to the working set exactly if the first nonzero term of its series points outward; an equality
always does.

With v_p and the rows above level p, W_a y = b_a, the multipliers of level p solve
W_a^T mu = -W_p^T v_p, level by level from p - 1 up; among dependent rows the shortest mu is the one
of the series. Each entry of a gradient carries what of it may be rounding: less counts as zero.
"""

import numpy as np

from hierarchy.jit import inlined, internal
from solvers.kernels.active_set.working_set import (
    BEGIN,
    DIAGONAL,
    FIRST,
    GOAL,
    GRADIENT,
    LIST,
    MISS,
    NOISE,
    NORM,
    ORDER,
    PICKED,
    RANK,
    SCRATCH,
    SHORT,
    SIGN,
    SIZE,
    STATE,
    WHOLE,
    Y,
    add_row,
    side_at,
    value_at,
)
from solvers.kernels.active_set.working_set import ZEROED as FORCE
from solvers.kernels.linalg.least_squares import turn
from solvers.kernels.linalg.rows import length_of, reflect
from solvers.kernels.linalg.space import fill, matrix
from solvers.kernels.tolerances import CANCELLED, EPSILON, FAINT, MET, NEGLIGIBLE, SHADOW
from solvers.status import EQUAL

OUTWARD, UNDECIDED, INWARD = 1, 0, -1


@internal
def write_multipliers(s):
    """Write the multipliers of all listed rows, and the sign of the first that is not zero."""
    levels, whole = s.multiplier.shape[0] - 1, s.count[WHOLE]
    reach = length_of(s.x) + SHADOW * s.scalar[SIZE]
    for p in range(levels + 1):
        fill(s.multiplier[p], 0.0)
    last = levels if whole < 0 else whole
    for k in range(last):
        _write_violations(s, k, reach)
    weight = 1.0
    if whole >= 0:
        weight = s.number[NORM, s.index[FIRST, whole]] ** 2
        for i in range(s.index[FIRST, whole], s.index[FIRST, whole + 1]):
            s.multiplier[whole, i] = value_at(s, i) - side_at(s, i)
    for p in range(last + 1):
        if _pull(s, p, reach) if p < last else _pull_of_goal(s, last, weight, reach):
            _balance(s, p)


@inlined
def _write_violations(s, k, reach):
    """Write the violations of the listed rows of level k, zero if all of them are rounding."""
    begin, end, missed, most = s.index[BEGIN, k], s.index[BEGIN, k + 1], False, 0.0
    for q in range(begin, end):
        i = s.index[LIST, q]
        least = MET * (s.number[NORM, i] * reach + abs(side_at(s, i)))
        missed |= abs(s.number[MISS, q]) > least
        most = max(most, abs(s.number[MISS, q]))
    for q in range(begin, end):
        i = s.index[LIST, q]
        v, state = -s.number[MISS, q], s.index[STATE, i]
        s.index[SIGN, q] = OUTWARD if state == EQUAL else UNDECIDED
        if missed:
            s.multiplier[k, i] = v
            if state != EQUAL and abs(v) > NEGLIGIBLE * most + EPSILON * s.number[NORM, i] * reach:
                s.index[SIGN, q] = OUTWARD if v * state > 0.0 else INWARD


@inlined
def _pull(s, p, reach):
    """Write the gradient of level p in the columns above it; return whether it has one."""
    above, begin, end = s.index[RANK, p], s.index[BEGIN, p], s.index[BEGIN, p + 1]
    least, far = np.inf, 0.0
    for t in range(above):
        s.number[GRADIENT, t] = s.number[NOISE, t] = 0.0
    for q in range(begin, end):
        i = s.index[LIST, q]
        s.number[FORCE, q] = force = s.multiplier[p, i]
        least, far = min(least, s.number[NORM, i]), max(far, abs(force))
    if far == 0.0 or above == 0:
        return False
    _add_rows(s, p, least, reach, far)
    return True


@inlined
def _pull_of_goal(s, level, weight, reach):
    """Write the step from the goal in the columns above a level; return whether there is one."""
    above, square = s.index[RANK, level], 0.0
    for t in range(above):
        y, goal = s.number[Y, t], s.number[GOAL, t]
        s.number[GRADIENT, t] = weight * (y - goal)
        s.number[NOISE, t] = weight * (CANCELLED * max(abs(y), abs(goal)) + EPSILON * reach)
        square += (y - goal) ** 2
    return np.sqrt(square) > CANCELLED * reach


@inlined
def _add_rows(s, k, least, reach, far):
    """Add the rows of level k times their forces to the gradient in the columns above it.

    For violations, of which `far` is the largest: `least` is the norm of the lightest row.
    """
    begin, end, above = s.index[BEGIN, k], s.index[BEGIN, k + 1], s.index[RANK, k]
    total, square, short = s.number[SCRATCH], 0.0, s.index[SHORT, k] == 1
    fill(total[:s.x.size if short else 0], 0.0)
    for q in range(begin, end):
        i, force = s.index[LIST, q], s.number[FORCE, q]
        norm = s.number[NORM, i]
        # The residual of a heavy row is as accurate as the lightest row of its level asks.
        unsure = EPSILON * (min(norm, least * least / norm) * reach + far)
        if short:
            add_row(s, i, force, total)
            square += (norm * (unsure + CANCELLED * abs(force))) ** 2
        elif force != 0.0 or unsure > 0.0:
            _add(s, force, unsure, q, 0, above)
    if short:
        reflect(s.basis, s.count[PICKED], above, s.number, SCRATCH, SCRATCH + 1)
        for t in range(above):
            s.number[GRADIENT, t] += total[t]
            s.number[NOISE, t] += np.sqrt(square)


@inlined
def _add(s, f, unsure, q, begin, end):
    """Add a multiple of the row at place q to the gradient in these columns."""
    w, gradient, noise = s.W[q], s.number[GRADIENT], s.number[NOISE]
    unsure += CANCELLED * abs(f)
    faint = FAINT * s.number[NORM, s.index[LIST, q]]
    for t in range(begin, end):
        gradient[t] += f * w[t]
        noise[t] += abs(w[t]) * unsure + min(abs(w[t]), faint) * abs(f)


@internal
def refine(s, p):
    """Correct the multipliers of level p by what remains of its gradient, by unknown in GRADIENT.

    Large multipliers of nearly dependent rows leave rounding in unknowns that no such row touches,
    and so do those of heavy rows, whose violations are corrected too: a shift of their sides.
    """
    n, picked, whole = s.x.size, s.count[PICKED], s.count[WHOLE]
    last = min(p + 1, whole if whole >= 0 else s.multiplier.shape[0] - 1)
    for t in range(n):
        s.number[SCRATCH, t] = s.number[GRADIENT, s.index[ORDER, t]]
    reflect(s.basis, picked, s.index[RANK, last], s.number, SCRATCH, SCRATCH + 1)
    for t in range(n):
        s.number[GRADIENT, t], s.number[NOISE, t] = s.number[SCRATCH, t], 0.0
    _write_forces(s, last)
    for q in range(s.index[BEGIN, last]):
        s.multiplier[p, s.index[LIST, q]] += s.number[FORCE, q]


@inlined
def _write_forces(s, last):
    """Write the forces of the rows of the levels before `last` that take the gradient to zero."""
    for k in range(last - 1, -1, -1):
        begin, end = s.index[BEGIN, k], s.index[BEGIN, k + 1]
        if end - begin > s.index[RANK, k + 1] - s.index[RANK, k]:
            _share(s, begin, end, s.index[RANK, k], s.index[RANK, k + 1])
        else:
            for q in range(end - 1, begin - 1, -1):
                t = s.index[RANK, k] + q - begin
                pull, enough = s.number[GRADIENT, t], s.number[NOISE, t]
                s.number[FORCE, q] = force = -pull / s.W[q, t] if abs(pull) > enough else 0.0
                if force != 0.0:
                    _add(s, force, 0.0, q, s.index[RANK, k], t)
        if s.index[RANK, k] > 0:
            _add_rows(s, k, 0.0, 0.0, 0.0)


@inlined
def _balance(s, p):
    """Write the multipliers in level p of the rows of the levels above, and their signs."""
    _write_forces(s, p)
    for q in range(s.index[BEGIN, p]):
        i, force = s.index[LIST, q], s.number[FORCE, q]
        if force != 0.0:
            s.multiplier[p, i] = force
            if s.index[SIGN, q] == UNDECIDED:
                s.index[SIGN, q] = OUTWARD if force * s.index[STATE, i] > 0.0 else INWARD


@inlined
def _share(s, begin, end, above, rank):
    """Write the shortest forces of a level of dependent rows."""
    force = s.number[FORCE]
    fill(force[begin:end], 0.0)
    T, _ = matrix(s.T, above * s.W.shape[0], rank - above, end - begin)
    for k in range(rank - above):
        pull, unsure = s.number[GRADIENT, above + k], s.number[NOISE, above + k]
        for r in range(k):
            part = T[k, r] * force[begin + r]
            pull += part
            unsure += CANCELLED * abs(part)
        if abs(pull) > unsure:
            force[begin + k] = -pull / s.number[DIAGONAL, above + k]
    turn(T, force[begin:], True)
    most = 0.0
    for q in range(begin, end):
        most = max(most, abs(force[q]) * s.number[NORM, s.index[LIST, q]])
    for q in range(begin, end):
        if abs(force[q]) * s.number[NORM, s.index[LIST, q]] <= NEGLIGIBLE * most:
            force[q] = 0.0
