"""Joints held at their bounds as columns of Q, and the way to the reference beside them.

Q has columns for the tasks above, then one for each held joint in the order of holding; what
follows is free. Rows of the matrix W of `sns`, by `places`:

    0 .. m - 1  a task's rows in Q, factored     S ..  the same, not factored
    V ..        reflectors kept for later        E ..  held joints: unit vectors in Q
    U ..        reflectors of Q                  X ..  nine vectors
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from hierarchy.compiled import compiled, inlined
from solvers.kernels.flat import make_reflector, reflect_rows
from solvers.kernels.rows import ROUNDING, ZERO

SLACK = 1e-12  # by which a joint may pass a bound before it is put back, relative to 1 + |bound|
NO_JOINT = -1


@inlined
def places(m, n):
    """First rows V, S, E, U and X of what W holds."""
    return m, m + n, 2 * m + n, 2 * m + 2 * n, 2 * m + 3 * n


@compiled
def enter(W, beta, U, count, i0, i1):
    """Turn rows i0 .. i1 - 1 of W into coordinates of Q, of which `count` reflectors are made."""
    reflect_rows(W, beta, U, ZERO, count, i0, i1)


@compiled
def leave(W, beta, U, count, i0, i1):
    """Turn rows i0 .. i1 - 1 of W back from coordinates of Q."""
    for k in range(count - 1, -1, -1):
        reflect_rows(W, beta, U, k, k + 1, i0, i1)


@compiled
def hold(W, m, beta, y, held, joint, j, way, above, count, first, last, least):
    """Give joint j, whose side is in held, a column of Q and write its step there into y.

    way is how far it has to go; the task's rows first .. last - 1, not factored, go along. Returns
    how many joints are held then: `count` where less than `least` of its unit vector is left.
    """
    _, S, E, U, _ = places(m, y.size)
    k, e = above + count, W[E + count]
    for i in range(e.size):
        e[i] = 0.0
    e[j] = 1.0
    enter(W, beta, U, k, E + count, E + count + 1)
    square = 0.0
    for i in range(k, e.size):
        square += e[i] * e[i]
    if not square > least * least:
        held[j] = 0.0
        return count
    make_reflector(W, beta, U, k, E + count, square)
    reflect_rows(W, beta, U, k, k + 1, E + count, E + count + 1)
    reflect_rows(W, beta, U, k, k + 1, S + first, S + last)
    for i in range(above, k):
        way -= e[i] * y[i]
    y[k] = way / e[k]
    joint[count] = j
    return count + 1


@compiled
def hold_again(W, m, x, box, beta, y, held, joint, above, count, first, last, least):
    """Give columns of Q to those of the first `count` joints that are still held; see `hold`."""
    holding = ZERO
    for t in range(count):
        j = joint[t]
        if held[j] != 0.0:
            side = box[1, j] if held[j] > 0.0 else box[0, j]
            holding = hold(W, m, beta, y, held, joint, j, side - x[j], above, holding, first, last,
                           least)
    return holding


@compiled
def to_reference(m, x, box, W, joint, rank, release):
    """Move x in the columns of Q that no task has, inside the box; return the steps.

    Without release: to x plus the reference as far as the bounds let it, joints that they stop
    being held; with it: to the x nearest to the reference.
    """
    n = x.size
    _, _, _, U, X = places(m, n)
    d, target, y, beta, held = W[X], W[X + 2], W[X + 3], W[X + 5], W[X + 6]
    for j in range(n):
        held[j], target[j] = 0.0, box[2, j] + (0.0 if release else x[j])
    count, steps = ZERO, 0
    while steps < 4 * n + 2:
        steps += 1
        begin = rank + count
        for j in range(n):
            d[j] = target[j] - x[j]
        enter(W, beta, U, begin, X, X + 1)
        for k in range(begin):
            y[k], d[k] = d[k], 0.0
        leave(W, beta, U, begin, X, X + 1)
        stopped = _step(x, d, box, held)
        if stopped != NO_JOINT:
            held[stopped] = 1.0 if d[stopped] > 0.0 else -1.0
            count = hold(W, m, beta, y, held, joint, stopped, 0.0, rank, count, ZERO, ZERO,
                         ROUNDING)
            if rank + count == begin:
                break
        elif release and _drop(W, m, y, joint, held, rank, begin):
            count = hold_again(W, m, x, box, beta, y, held, joint, rank, count, ZERO, ZERO,
                               ROUNDING)
        else:
            break
    return steps


@inlined
def _step(x, d, box, held):
    """Move x along d as far as the box lets it, x + d at most; return the joint that stops it."""
    size, share, stopped = 0.0, 1.0, NO_JOINT
    for j in range(x.size):
        size = max(size, abs(d[j]))
    for j in range(x.size):
        if held[j] == 0.0 and abs(d[j]) > ROUNDING * size:
            room = (box[1, j] if d[j] > 0.0 else box[0, j]) - x[j]
            if room / d[j] < share:
                share, stopped = room / d[j], j
    for j in range(x.size):
        if held[j] == 0.0:
            x[j] = min(max(x[j] + share * d[j], box[0, j]), box[1, j])
    if stopped != NO_JOINT:
        x[stopped] = box[1, stopped] if d[stopped] > 0.0 else box[0, stopped]
    return stopped


@inlined
def _drop(W, m, y, joint, held, rank, begin):
    """Release the held joint that the way to the reference pulls inward most, if there is one.

    y[rank:begin] is that way in the columns of the held joints; it goes out as multipliers.
    """
    _, _, E, _, _ = places(m, y.size)
    size, worst, at = 0.0, 0.0, NO_JOINT
    for k in range(rank, begin):
        size = max(size, abs(y[k]))
    for k in range(begin - 1, rank - 1, -1):
        for i in range(k + 1, begin):
            y[k] -= W[E + i - rank, k] * y[i]
        y[k] /= W[E + k - rank, k]
        j = joint[k - rank]
        if y[k] * held[j] < worst - SLACK * size:
            worst, at = y[k] * held[j], j
    if at == NO_JOINT:
        return False
    held[at] = 0.0
    return True
