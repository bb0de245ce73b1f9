"""Which inequality rows act in each tick, as far as the resolver says."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Hierarchy
from solvers import Resolution, Status
from solvers.resolvers.saturation import SaturatedResolution
from solvers.status import EQUAL, FREE

Row = tuple[str, int, int]  # task, row of the task, side: 1 upper, -1 lower


@final
class ActiveSets:
    """Numbers the sets of acting inequality rows in the order in which they first occur.

    A row is known by its task, its place in the task and the side at which it acts, so that a
    change of the stack is no change of the set unless rows that act come or go. Of a resolver that
    reports saturated unknowns, these are the rows.
    """

    def __init__(self, ticks: int) -> None:
        self._number = np.full(ticks, -1, dtype=np.int32)
        self._numbers: dict[frozenset[Row], int] = {}
        self._seen: dict[tuple[object, ...], int] = {}  # by stack and row states

    def look(self, tick: int, h: Hierarchy, resolution: Resolution) -> None:
        """Note the set of a tick; unknown, -1, unless the resolver solved it and reports it."""
        if resolution.status is not Status.SOLVED:
            return
        if isinstance(resolution, SaturatedResolution):
            self._note(tick, h, resolution.saturated, _bounds)
        elif resolution.active is not None:
            self._note(tick, h, resolution.active, _rows)

    def _note(self, tick: int, h: Hierarchy, states: NDArray[np.int8],
              rows: Callable[[Hierarchy, NDArray[np.int8]], Iterator[Row]]) -> None:
        key = h.names, rows, states.tobytes()
        if key not in self._seen:
            acting = frozenset(rows(h, states))
            self._seen[key] = self._numbers.setdefault(acting, len(self._numbers))
        self._number[tick] = self._seen[key]

    def signals(self, ticks: int) -> dict[str, NDArray[np.int32]]:
        """Return `active_set` of the first `ticks` ticks, nothing if no set is known."""
        return {"active_set": self._number[:ticks].copy()} if self._numbers else {}


def _rows(h: Hierarchy, active: NDArray[np.int8]) -> Iterator[Row]:
    """Yield the acting inequality rows; `active` (m,) as in a Resolution."""
    for i in np.flatnonzero((active != FREE) & (active != EQUAL)).tolist():
        level = int((h.offsets[1:] <= i).sum())
        yield h.names[level], i - int(h.offsets[level]), int(active[i])


def _bounds(h: Hierarchy, saturated: NDArray[np.int8]) -> Iterator[Row]:
    """Yield the saturated unknowns, as rows of the first level that has any."""
    bounds = h.names[int(np.argmax(h.sizes > 0))]
    for i in np.flatnonzero((saturated != FREE) & (saturated != EQUAL)).tolist():
        yield bounds, i, int(saturated[i])
