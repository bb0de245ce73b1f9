"""Joints held at their bounds as columns of Q, and the step to the reference next to them.

Q has columns for the tasks above, then one for each held joint in the order of holding; the rest is
free.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

from hierarchy.jit import compiled, inlined, inner_product
from solvers.kernels.rows import ZERO, make_reflector, reflect, reflect_back
from solvers.kernels.space import View, integers, matrix, vector
from solvers.kernels.tolerances import BOUND_KEPT, TERMS

NO_JOINT = -1


class Box(NamedTuple):
    """Sides of the box and the reference, (n,) each."""

    low: View
    up: View
    reference: View


class Held(NamedTuple):
    """Held joints.

    basis: the reflectors of Q. E (n, n): unit vectors of the held joints, in coordinates of Q, in
    the order of holding. joint (n,): their indices. side (n,): +1, -1 for a joint held at its
    upper, lower bound, else 0. y (n,): the step in each column of Q.
    """

    basis: View
    E: View
    joint: View
    side: View
    y: View


@inlined
def carve_box(work, at, n):
    """Return a Box for n joints, and where it ends."""
    low, at = vector(work, at, n)
    up, at = vector(work, at, n)
    reference, at = vector(work, at, n)
    return Box(low, up, reference), at


@inlined
def carve_held(work, at, n):
    """Return Held for n joints, and where it ends."""
    basis, at = matrix(work, at, n, n)
    E, at = matrix(work, at, n, n)
    joint, at = integers(work, at, n)
    side, at = vector(work, at, n)
    y, at = vector(work, at, n)
    return Held(basis, E, joint, side, y), at


@inlined
def side_of_box(box, held, j):
    """Return the bound at which joint j is held."""
    return box.up[j] if held.side[j] > 0.0 else box.low[j]


@compiled
def hold(held, seen, j, way, above, count, least):
    """Give joint j, whose side is written, a column of Q, and write its step there into y.

    way: its distance to the bound. seen: the rows of a task in coordinates of Q, reflected too.
    Returns the number of held joints: still `count` if the remainder of its unit vector is at most
    `least`.
    """
    k, e, basis = above + count, held.E[count], held.basis
    for i in range(e.size):
        e[i] = 0.0
    e[j] = 1.0
    reflect(basis, ZERO, k, held.E, count, count + 1)
    square = inner_product(e[k:], e[k:])
    if not square > least * least:
        held.side[j] = 0.0
        return count
    make_reflector(basis, k, e, square)
    reflect(basis, k, k + 1, held.E, count, count + 1)
    reflect(basis, k, k + 1, seen, ZERO, seen.shape[0])
    held.y[k] = (way - inner_product(e[above:k], held.y[above:])) / e[k]
    held.joint[count] = j
    return count + 1


@compiled
def hold_again(held, seen, x, box, above, count, least):
    """Give columns of Q to the joints among the first `count` that remain held; see `hold`."""
    holding = ZERO
    for t in range(count):
        j = held.joint[t]
        if held.side[j] != 0.0:
            way = side_of_box(box, held, j) - x[j]
            holding = hold(held, seen, j, way, above, holding, least)
    return holding


@compiled
def to_reference(held, box, x, ways, rank, release):
    """Move x inside the box, in the columns of Q that no task has; return the number of steps.

    Without release: to x plus the reference as far as the bounds allow, holding joints that reach
    one. With release: to the x nearest to the reference. ways (2, n): any contents.
    """
    n = x.size
    d, target, no_rows = ways[0], ways[1], ways[:0]
    for j in range(n):
        held.side[j], target[j] = 0.0, box.reference[j] + (0.0 if release else x[j])
    count, steps = ZERO, 0
    while steps < 4 * n + 2:
        steps += 1
        begin = rank + count
        _free_way(held, x, target, ways, begin)
        stopped = _step(x, d, box, held.side)
        if stopped != NO_JOINT:
            held.side[stopped] = 1.0 if d[stopped] > 0.0 else -1.0
            count = hold(held, no_rows, stopped, 0.0, rank, count, TERMS)
            if rank + count == begin:
                break
        elif release and _drop(held, rank, begin):
            count = hold_again(held, no_rows, x, box, rank, count, TERMS)
        else:
            break
    return steps


@inlined
def _free_way(held, x, target, ways, begin):
    """Write the step from x to the target in columns `begin` and on; the other columns to y."""
    d = ways[0]
    for j in range(x.size):
        d[j] = target[j] - x[j]
    reflect(held.basis, ZERO, begin, ways, ZERO, ZERO + 1)
    for k in range(begin):
        held.y[k], d[k] = d[k], 0.0
    reflect_back(held.basis, begin, ways, ZERO, ZERO + 1)


@inlined
def _step(x, d, box, side):
    """Move x along d as far as the box allows, at most x + d; return the joint that stops it."""
    size, share, stopped = 0.0, 1.0, NO_JOINT
    for j in range(x.size):
        size = max(size, abs(d[j]))
    for j in range(x.size):
        if side[j] == 0.0 and abs(d[j]) > TERMS * size:
            room = (box.up[j] if d[j] > 0.0 else box.low[j]) - x[j]
            if room / d[j] < share:
                share, stopped = room / d[j], j
    for j in range(x.size):
        if side[j] == 0.0:
            x[j] = min(max(x[j] + share * d[j], box.low[j]), box.up[j])
    if stopped != NO_JOINT:
        x[stopped] = box.up[stopped] if d[stopped] > 0.0 else box.low[stopped]
    return stopped


@inlined
def _drop(held, rank, begin):
    """Release the held joint that the step to the reference pulls inward most, if there is one.

    y[rank:begin] is that step in the columns of the held joints on entry, multipliers on return.
    """
    y, E = held.y, held.E
    size, worst, at = 0.0, 0.0, NO_JOINT
    for k in range(rank, begin):
        size = max(size, abs(y[k]))
    for k in range(begin - 1, rank - 1, -1):
        for i in range(k + 1, begin):
            y[k] -= E[i - rank, k] * y[i]
        y[k] /= E[k - rank, k]
        j = held.joint[k - rank]
        if y[k] * held.side[j] < worst - BOUND_KEPT * size:
            worst, at = y[k] * held.side[j], j
    if at == NO_JOINT:
        return False
    held.side[at] = 0.0
    return True
