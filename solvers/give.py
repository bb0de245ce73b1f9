"""Resolving a hierarchy whose levels may give, around a resolver's own `solve`."""

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from hierarchy.problem import Array, Hierarchy
from solvers.kernels.give import misses, relax
from solvers.resolution import Resolution
from solvers.status import Status

_Kind = TypeVar("_Kind", bound=Resolution)
_NONE = np.empty(0)  # memory of a solve that was not needed


def giving(solve: Callable[[Hierarchy, Array | None], _Kind], h: Hierarchy, levels: Sequence[int],
           memory: Array | None) -> _Kind:
    """Return the answer of `solve` to h, whose `levels` may give.

    The levels down to the last that gives are resolved alone: the answer is a witness of the least
    miss of the first level that gives, (K, n) in `witnesses` for K such levels. Its rows then get
    that miss and what they give as room, see `Hierarchy.relaxed`. For the next such level the same
    answer is a witness if it meets all levels from there to this one; otherwise it is resolved
    again. Without an answer for one of them the resolution is that of the part. `memory` is that of
    all these solves, as far as they came.
    """
    (A, lower, upper, sizes), offsets, give = h.rows, h.offsets, h.give
    sides = lower, upper = lower.copy(), upper.copy()
    part, whole = (h.upper_part(count, sides) for count in (levels[-1] + 1, len(sizes)))
    before, after = _split(memory, 1 + len(levels)), list[Array | None]()
    found, witnesses, inaccurate, room = None, [], False, 0
    for level in levels:
        rows = int(offsets[level]), int(offsets[level + 1])
        if found is None or misses(A, lower, upper, found.x, room, rows[1]):
            found = solve(part, before[len(after)])
            if found.status not in (Status.SOLVED, Status.INACCURATE):
                failed = found.status is Status.NUMERICAL_FAILURE
                found.memory = None if failed else _joined([*after, found.memory,
                                                            *before[len(after) + 1:]])
                return found
            after.append(found.memory)
            inaccurate |= found.status is Status.INACCURATE
        witnesses.append(found.x)
        relax(A, lower, upper, give, found.x, *rows)
        room = rows[1]  # the first row that the room just made may change
    after += [None] * (len(levels) - len(after))
    found = solve(whole, before[-1])
    found.memory = _joined([*after, found.memory])
    found.witnesses = np.array(witnesses)
    if inaccurate and found.status is Status.SOLVED:
        found.status = Status.INACCURATE
    return found


def _joined(memories: list[Array | None]) -> Array | None:
    """Return memories one after the other, then the length of each; the last if they are not flat.

    None if all are none.
    """
    known = [memory for memory in memories if memory is not None]
    if not known or known[-1].ndim != 1:
        return memories[-1]
    flat = [_NONE if memory is None else memory for memory in memories]
    return np.concatenate([*flat, [memory.size for memory in flat]])


def _split(memory: Array | None, count: int) -> list[Array | None]:
    """Return the memories that `_joined` has joined; another one is the last."""
    alone: list[Array | None] = [*[None] * (count - 1), memory]
    if memory is None or memory.ndim != 1 or memory.size < count:
        return alone
    parts, at = list[Array | None](), 0
    for length in memory[-count:].tolist():
        if not 0.0 <= length <= memory.size:
            return alone
        parts.append(memory[at:(at := at + int(length))])
    return parts if at == memory.size - count else alone
