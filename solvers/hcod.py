"""Exact lexicographic least squares with inequalities at every level: our own active-set solver."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any, ClassVar, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.certificate import certify
from solvers.kernels.hcod import UNPROVED, hcod, hcod_equalities
from solvers.kernels.rows import TOO_SMALL
from solvers.kernels.stages import solve_by_stages
from solvers.resolver import Handles, Resolution, Resolver, Status, register
from solvers.workspace import WORKSPACE


@final
class ActiveSetResolution(Resolution):
    """A resolution that says which rows act, and what each of them holds back.

    Attributes beside those of `Resolution`; m rows, L levels
    ----------
    active : (m,) int8, 2 for an equality, +1 for a row at or above its upper side, -1 for one at
        or below its lower side, 0 for one that does not matter.
    holds_back : (m,) int16, the first level that this inequality row keeps from being met better:
        its own where it stays violated, L for the way to the reference, -1 for none.
    multipliers : (m,) of the rows in that level; the violation itself in the row's own level.
    unfinished : the level at which the iterations ended, or None.
    """

    __slots__ = ()

    def __init__(self, x: Array, status: Status, memory: Array) -> None:
        self.x, self.status, self.memory = x, status, memory

    @property
    def iterations(self) -> int:  # type: ignore[override]
        """Active sets guessed and steps by stages."""
        return int(self.memory[-3] + self.memory[-2])

    @property
    def active(self) -> NDArray[np.int8]:
        """What each row does: (m,)."""
        return self._part(0).astype(np.int8)

    @property
    def holds_back(self) -> NDArray[np.int16]:
        """Which level each row holds back: (m,)."""
        return self._part(1).astype(np.int16)

    @property
    def multipliers(self) -> Array:
        """How strongly: (m,), in units of that level's violation over those of the row."""
        return self._part(2).copy()

    @property
    def unfinished(self) -> int | None:
        """The level that was being worked on when the iterations ended."""
        return int(self.memory[-1]) if self.status is Status.ITERATION_LIMIT else None

    def _part(self, which: int) -> Array:
        m = (len(self.memory) - 3) // 3
        part: Array = self.memory[which * m:(which + 1) * m]
        return part


@final
@register
@dataclass(frozen=True, kw_only=True)
class Hcod(Resolver):
    """Active set, exact at any rank, equalities and two-sided inequalities at every level.

    Guesses the active set, solves it by the staircase of `tpm`, and proves the answer by its
    multipliers; where `guesses` do not lead there, a primal active set goes level by level. On
    equalities alone it is `tpm`, to the last digit, damped or not. With inequalities, damping makes
    it go level by level: a level minimises ||what it misses||^2 + lambda^2 ||its own step||^2
    inside the rows above, lambda being the largest of the active sets met on the way.

    Where nearly parallel rows, or rows of very different scale, leave a doubt about the active set,
    `certify` judges; an answer that it does not accept has Status.INACCURATE. (Not with damping
    on, which is for such rows and makes another problem of it.)

    tolerance : of violations and multipliers, relative to the size of the terms they are made of.
    guesses : active sets tried before going level by level; at least 1.
    max_iterations : steps by levels, then Status.ITERATION_LIMIT: x keeps the levels above the
        one that was being worked on.

    The memory is the active set; with that of the tick before most solves need one guess. The
    answer does not depend on it beyond rounding. Sources: Escande, Mansard, Wieber, "Hierarchical
    quadratic programming" (2014); Dimitrov, Sherikov, Wieber, "Efficient resolution of potentially
    conflicting linear constraints in robotics" (2015); Hintermueller, Ito, Kunisch, "The
    primal-dual active set strategy as a semismooth Newton method" (2002).
    """

    name: ClassVar[str] = "hcod"
    handles: ClassVar[Handles] = "inequalities"
    tolerance: float = 1e-10
    guesses: int = 3
    max_iterations: int = 1000

    def __post_init__(self) -> None:
        super().__post_init__()
        self._number("tolerance", 0.0, 1e-3, open_below=True)
        for setting in ("guesses", "max_iterations"):
            value = getattr(self, setting)
            if not isinstance(value, int) or isinstance(value, bool) or not 1 <= value < 2**31:
                raise HierarchyError(f"hcod: {setting} = {value!r}, expected a whole number >= 1")

    @cached_property
    def _settings(self) -> Array:
        return np.array([self.damping, self.threshold, self.rank_tolerance, self.tolerance,
                         self.guesses, self.max_iterations], dtype=float)

    def solve(self, h: Hierarchy, memory: Any = None) -> ActiveSetResolution:
        """Resolve h, beginning with the active set of an earlier resolution if one is given."""
        x = h.reference.copy()
        size = 3 * len(h.lower) + 3
        fits = memory is not None and len(memory) == size
        record = memory.copy() if fits else np.zeros(size)
        problem = (h.A, h.lower, h.upper, h.sizes, x, record, self._settings, WORKSPACE.array)
        equal = len(h.lower) == 0 or h.lower.item(0) == h.upper.item(0)
        code = hcod_equalities(*problem) if equal else UNPROVED
        if code == UNPROVED:
            code = hcod(*problem)
        if code == 0:
            return ActiveSetResolution(x, _SOLVED, record)
        if code == TOO_SMALL:
            WORKSPACE.double()
            return self.solve(h, memory)
        if code != UNPROVED:
            return ActiveSetResolution(x, Status(code), record)
        resolution = self._by_stages(h, record)
        return (self._without_doubt(h, resolution) if resolution.status is Status.INACCURATE
                else resolution)

    def _by_stages(self, h: Hierarchy, record: Array, share: float = 1.0) -> ActiveSetResolution:
        """Go level by level, with a share of the tolerance."""
        x, settings = h.reference.copy(), self._settings.copy()
        settings[3] *= share
        problem = (h.A, h.lower, h.upper, h.sizes, x, record, settings)
        while (code := solve_by_stages(*problem, WORKSPACE.array)) == TOO_SMALL:
            WORKSPACE.double()
        return ActiveSetResolution(x, Status(code), record)

    def _without_doubt(self, h: Hierarchy, first: ActiveSetResolution) -> ActiveSetResolution:
        """Let `certify` judge a doubtful answer, and others found with finer tolerances."""
        finer = (self._by_stages(h, first.memory.copy(), share) for share in _FINER)
        for answer in chain([first], finer):
            if answer.status in (Status.SOLVED, Status.INACCURATE) and certify(
                    h, answer.x).certified:
                answer.status = Status.SOLVED
                return answer
        return first


_SOLVED = Status.SOLVED
_FINER = (1e-2, 1e-3)  # shares of the tolerance that a doubtful answer is tried again with
