"""Resolving a hierarchy whose levels may give, around a resolver's own `solve`."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from hierarchy.problem import Array, Hierarchy
from solvers.resolution import Resolution
from solvers.status import Status

_Kind = TypeVar("_Kind", bound=Resolution)


def giving(solve: Callable[[Hierarchy, Array | None], _Kind], h: Hierarchy,
           memory: Array | None) -> _Kind:
    """Return the answer of `solve` to h, level by level where rows may give.

    For each level that gives, the levels down to it are resolved alone: their answer is the witness
    of its least miss, (K, n) in `witnesses` for K such levels. Its rows then get that miss and what
    they give as room, see `Hierarchy.relaxed`, and so all levels below. `memory` is that of the
    last of these hierarchies, which has the rows of all levels. Without an answer for one of them
    the resolution is that of the part.
    """
    witnesses, inaccurate = [], False
    for level in h.giving:
        found = solve(h.upper_part(level + 1), None)
        if found.status not in (Status.SOLVED, Status.INACCURATE):
            found.memory = None
            return found
        inaccurate |= found.status is Status.INACCURATE
        witnesses.append(found.x)
        h = h.relaxed(level, found.x)
    found = solve(h, memory)
    found.witnesses = np.array(witnesses)
    if inaccurate and found.status is Status.SOLVED:
        found.status = Status.INACCURATE
    return found
