"""Set-based tasks: one-sided rows that are ignored, or frozen as equalities."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, combinations, islice
from typing import final

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.gate import sound_rows
from hierarchy.problem import Array, Hierarchy
from solvers.resolver import Around, Resolution, number, place_of, whole_number
from solvers.status import EQUAL, FREE, LOWER, UPPER, Status


@final
@dataclass(frozen=True, kw_only=True)
class SetBased(Around):
    """The modes of set-based tasks over the equality stacks that `inner` resolves.

    A row with one side is the extended tangent cone of a task at the bound of its set or beyond
    (`TangentCone`): its rate must not pass the side. A mode freezes some of these
    rows as equalities and ignores the others; docs/theory/set-based.md says which mode is taken,
    and where this differs from the source.

    tolerance : of a rate beyond its side, relative to 1 + |x|.
    most : modes resolved before the most restrictive one.

    Raises HierarchyError from `solve`, naming level, row and sides, if a row has two sides.

    Source: Moe, Antonelli, Teel, Pettersen, Schrimpf, "Set-Based Tasks within the
    Singularity-Robust Multiple Task-Priority Inverse Kinematics Framework", Frontiers in Robotics
    and AI 3:16 (2016).
    """

    tolerance: float = number(1e-10, high=1e-3)
    most: int = whole_number(256, 1)
    name = "set-based"
    handles = "inequalities"

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h; every mode is resolved afresh, `memory` is not used.

        Of the mode that was chosen `active` says EQUAL for an equality, UPPER or LOWER for a frozen
        row, FREE for one that is ignored; `iterations` is the number of modes resolved.
        """
        if not sound_rows(*h.rows[:3]):  # NaN is no side, and would be ignored
            return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)
        active = _states(h)
        edges = np.flatnonzero((active == LOWER) | (active == UPPER))
        for count, frozen in enumerate(_modes(edges, self.most), 1):
            ignored = np.setdiff1d(edges, frozen, assume_unique=True)
            found = self.inner.solve(_mode(h, active, ignored))
            if self._in_tangent_cones(h, ignored, found.x):
                active[ignored] = FREE
                return Resolution(found.x, found.status, count, active=active)
        raise AssertionError("the last mode ignores no row")

    def _in_tangent_cones(self, h: Hierarchy, rows: NDArray[np.int64], x: Array) -> bool:
        """Whether the rates A x of the rows are in T_RC, in_T_RC of the source."""
        if not len(rows):
            return True
        rates, near = h.A[rows] @ x, self.tolerance * (1.0 + np.sqrt(x @ x))
        return bool(((rates >= h.lower[rows] - near) & (rates <= h.upper[rows] + near)).all())


def _states(h: Hierarchy) -> NDArray[np.int8]:
    """Return what each row (m,) is: an equality, at its lower or upper side, or inside."""
    low, up, equal = np.isfinite(h.lower), np.isfinite(h.upper), h.lower == h.upper
    for (row,) in np.argwhere(low & up & ~equal)[:1]:
        raise HierarchyError(f"{place_of(h, row)}: two sides, {h.lower[row]:g} <= a x <= "
                             f"{h.upper[row]:g}; a set-based task is at one of its bounds or at "
                             "none")
    return np.select([equal, low, up], [EQUAL, LOWER, UPPER], FREE).astype(np.int8)


def _modes(edges: NDArray[np.int64], most: int) -> Iterator[NDArray[np.int64]]:
    """Yield the rows frozen in each mode, the fewest first; the last mode freezes all."""
    sizes = range(len(edges))
    fewer = chain.from_iterable(combinations(edges.tolist(), size) for size in sizes)
    for rows in islice(fewer, most):
        yield np.array(rows, dtype=np.int64)
    yield edges


def _mode(h: Hierarchy, active: NDArray[np.int8], ignored: NDArray[np.int64]) -> Hierarchy:
    """Return the equality stack of a mode: h without the rows inside and those ignored."""
    keep = active != FREE
    keep[ignored] = False
    if keep.all():
        b = np.where(active == UPPER, h.upper, h.lower)
        return h.changed(lower=b, upper=b)
    level = np.repeat(np.arange(len(h.sizes)), h.sizes)[keep]
    b = np.where(active == UPPER, h.upper, h.lower)[keep]
    sizes = np.bincount(level, minlength=len(h.sizes)).astype(np.int64)
    return h.changed(A=h.A[keep], lower=b, upper=b, sizes=sizes, give=None)
