"""The exact engine: lexicographic least squares with inequalities at every level."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.certificate import certify
from solvers.kernels.guess import solve_by_guesses
from solvers.kernels.levels import solve_by_levels
from solvers.kernels.staircase import solve_equalities
from solvers.resolver import Handles, Resolution, Resolver, register
from solvers.status import EQUAL, NO_LIMITS, TOO_SMALL, UNPROVED, Status
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
        """Active sets guessed, and steps by levels."""
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
    """Active set on a hierarchical factorisation, exact at any rank, inequalities at every level.

    It is not the decomposition of Escande, Mansard and Wieber; docs/hcod.md says how it differs.

    Equalities alone are resolved by the staircase of `tpm`, to the last digit. With the memory of
    the tick before, its active set is solved and proved by its multipliers; where that fails within
    `guesses`, and without a memory, a primal active set goes level by level. With damping and
    inequalities a level minimises ||what it misses||^2 + lambda^2 ||its own step||^2 inside the
    rows above. Where rounding leaves a doubt (docs/hcod.md says when), `certify` judges; an answer
    that it does not accept has Status.INACCURATE. (Not with damping on.)

    tolerance : of violations, relative to the size of the terms they are made of.
    guesses : active sets tried before going level by level; at least 1.
    max_iterations : steps by levels, then Status.ITERATION_LIMIT: x keeps the levels above.
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
        known = memory is not None and len(memory) == size and self.damping == 0.0
        record = memory.copy() if known else np.zeros(size)
        code = solve_exactly(h, x, record, self._settings, known)
        if code == 0 or (code == _INACCURATE and certify(h, x).certified):
            return ActiveSetResolution(x, _SOLVED, record)
        return ActiveSetResolution(x, Status(code), record)


def solve_exactly(h: Hierarchy, x: Array, record: Array, settings: Array, known: bool) -> int:
    """Call the kernels one after the other until one has an answer; return its code.

    Equalities go to the staircase, a known active set to guesses, all else to levels. x (n,) comes
    in as the reference and goes out as the answer; record (3 m + 3,), settings: see
    `solve_by_guesses`. A kernel calls no other, which would compile it again.
    """
    work, code = WORKSPACE.array, UNPROVED
    if not known or record[0] == EQUAL:
        code = solve_equalities(h.A, h.lower, h.upper, h.sizes, x, record, settings, work)
    if code == UNPROVED and known:
        code = solve_by_guesses(h.A, h.lower, h.upper, h.sizes, x, record, settings, work)
    if code == UNPROVED:
        code = solve_by_levels(h.A, h.lower, h.upper, h.sizes, x, record, settings, work)
    if code == TOO_SMALL:
        WORKSPACE.double()
    if code in (TOO_SMALL, NO_LIMITS):
        return solve_exactly(h, x, record, settings, known and code == TOO_SMALL)
    return code


_SOLVED, _INACCURATE = Status.SOLVED, Status.INACCURATE
