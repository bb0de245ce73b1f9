"""The exact resolver: lexicographic least squares with inequalities at every level."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array, Hierarchy
from solvers.certificate import TOLERANCE, certify
from solvers.kernels.bounds import solve_without_bounds
from solvers.kernels.guess import solve_by_guesses
from solvers.kernels.levels import solve_by_levels
from solvers.kernels.multipliers import prove_by_multipliers
from solvers.kernels.staircase import solve_equalities
from solvers.resolver import Handles, Resolution, Resolver, register
from solvers.status import EQUAL, INACCURATE, NO_LIMITS, SOLVED, TOO_SMALL, UNPROVED, Status
from solvers.workspace import WORKSPACE, entry, run


@final
class ActiveSetResolution(Resolution):
    """A resolution that reports the active rows and the level that each of them holds back.

    Attributes in addition to those of `Resolution`; m rows, L levels
    ----------
    active : (m,) int8, 2 for an equality, +1 for a row at or above its upper side, -1 for a row at
        or below its lower side, 0 for an inactive row.
    holds_back : (m,) int16, the first level that this inequality row keeps from being met better:
        its own level where it stays violated, L for the distance to the reference, -1 for none.
    multipliers : (m,) multiplier of each row in that level; in its own level, its violation.
    unfinished : the level at which the iteration limit was reached, or None.
    """

    __slots__ = ()

    memory: Array

    def __init__(self, x: Array, status: Status, memory: Array) -> None:
        self.x, self.status, self.memory, self.witnesses = x, status, memory, None

    @property
    def iterations(self) -> int:  # type: ignore[override]
        """Active sets tried, plus active-set steps level by level."""
        return int(self.memory[-3] + self.memory[-2])

    @property
    def active(self) -> NDArray[np.int8]:
        """State of each row: (m,)."""
        return self._part(0).astype(np.int8)

    @property
    def holds_back(self) -> NDArray[np.int16]:
        """Level that each row holds back: (m,)."""
        return self._part(1).astype(np.int16)

    @property
    def multipliers(self) -> Array:
        """Multiplier of each row: (m,), in units of that level's violation per unit of the row."""
        return self._part(2).copy()

    @property
    def unfinished(self) -> int | None:
        """The level at which the iteration limit was reached."""
        return int(self.memory[-1]) if self.status is Status.ITERATION_LIMIT else None

    def _part(self, which: int) -> Array:
        m = (len(self.memory) - 3) // 3
        part: Array = self.memory[which * m:(which + 1) * m]
        return part


@final
@register
@dataclass(frozen=True, kw_only=True)
class Hcod(Resolver):
    """Active-set method on a hierarchical factorisation; exact at any rank, with inequalities.

    Not the decomposition of Escande, Mansard and Wieber; docs/hcod.md says how it differs, and
    docs/theory/resolver-notes.md describes the method, its damping and its checks.

    Equalities alone give the answer of `tpm`, to the last digit. An answer in doubt after rounding
    (without damping) must be proved by its multipliers or accepted by `certify`; otherwise it has
    Status.INACCURATE.

    tolerance : of violations, relative to the size of the terms in them.
    guesses : active sets tried from a memory before solving level by level; at least 1.
    max_iterations : active-set steps, level by level, before Status.ITERATION_LIMIT; x is then
        optimal for the finished levels.
    """

    name: ClassVar[str] = "hcod"
    handles: ClassVar[Handles] = "inequalities"
    damps_with_bounds: ClassVar[str] = (
        "each level on its active set, unless x without bounds is within them")
    tolerance: float = 1e-10
    guesses: int = 3
    max_iterations: int = 1000

    def __post_init__(self) -> None:
        super().__post_init__()
        self._number("tolerance", 0.0, 1e-3, open_below=True)
        self._whole_number("guesses", 1)
        self._whole_number("max_iterations", 1)

    @cached_property
    def _settings(self) -> Array:
        return np.array([self.damping, self.threshold, self.rank_tolerance, self.tolerance,
                         self.guesses, self.max_iterations], dtype=float)

    def solve(self, h: Hierarchy, memory: Array | None = None) -> ActiveSetResolution:
        """Resolve h, starting from the active set of an earlier resolution if given."""
        x, settings, undamped = h.start(), self._settings, self.damping == 0.0
        record, known = warm_record(memory, 3 * h.m + 3, undamped)
        code = UNPROVED if undamped else solve_inside_bounds(h, x, record, settings)
        if code != SOLVED:
            code = solve_exactly(h, x, record, settings, known)
        if code == SOLVED or (code == INACCURATE and settle_doubt(h, x, record, settings)):
            return ActiveSetResolution(x, _SOLVED, record)
        return ActiveSetResolution(x, Status(code), record)


def warm_record(memory: Array | None, size: int, usable: bool) -> tuple[Array, bool]:
    """Return a record (size,) for the kernels, and whether it continues a memory: else zeros.

    usable : whether the settings allow a warm start.
    """
    if memory is None or memory.size != size or not usable:
        return np.zeros(size), False
    return memory.flatten(), True


def solve_inside_bounds(h: Hierarchy, x: Array, record: Array, settings: Array) -> int:
    """Write x (n,) and record as if no bound were in the way; SOLVED if x is within the bounds.

    Any other code: nothing is done, because x leaves the bounds or because h is anything but a
    first level of bounds with equalities below. `tpm` begins in the same way.
    """
    whole, answer = np.zeros(len(x) + len(h.sizes) + len(record)), x.copy()
    code = run(solve_without_bounds, *h.rows, answer, whole, settings)
    if code == SOLVED:
        x[:] = answer
        record_without_bounds(h.lower, h.upper, record)
    return code


def record_without_bounds(lower: Array, upper: Array, record: Array) -> None:
    """Write the records (..., 3 m + 3) of answers that no bound holds back; sides (..., m)."""
    m = lower.shape[-1]
    record[...] = 0.0
    record[..., :m] = np.where(lower == upper, EQUAL, 0.0)
    record[..., m:2 * m], record[..., -1] = -1.0, -1.0
    record[..., -3] = 1.0


def solve_exactly(h: Hierarchy, x: Array, record: Array, settings: Array, known: bool) -> int:
    """Call the kernels in turn until one finds an answer; return its code.

    The staircase takes equalities, `solve_by_guesses` a known active set, `solve_by_levels` the
    rest. x (n,) is the reference on entry and the answer on return; record (3 m + 3,) and settings:
    see `solve_by_guesses`. Entry kernels do not call each other: that would compile them twice.
    """
    work, code = WORKSPACE.array, UNPROVED
    A, lower, upper, sizes = h.rows  # `*h.rows` takes 60 ns more
    if not known or record.item(0) == EQUAL:  # an index takes twice the time
        code = entry(solve_equalities)(A, lower, upper, sizes, x, record, settings, work)
    if known and code == UNPROVED:
        code = entry(solve_by_guesses)(A, lower, upper, sizes, x, record, settings, work)
    if code == SOLVED:
        return code
    if code == UNPROVED:
        code = entry(solve_by_levels)(A, lower, upper, sizes, x, record, settings, work)
    if code == TOO_SMALL:
        WORKSPACE.double()
    if code in (TOO_SMALL, NO_LIMITS):
        return solve_exactly(h, x, record, settings, known and code == TOO_SMALL)
    return code


Name = Callable[[Hierarchy, Array, Array], None]


def name_nothing(h: Hierarchy, x: Array, record: Array) -> None:
    """Leave the record as it is, because it is that of the exact resolver alone."""


def settle_doubt(h: Hierarchy, x: Array, record: Array, settings: Array,
                 name: Name = name_nothing) -> bool:
    """Return whether an answer in doubt is proved, if need be after it is solved anew.

    - Level by level x may have been far off on the way, and dependent rows remember it: so the
      active set is solved again in one pass, which must be proved.
    - A row of 1e-17 beside one of 1 may be rounding, as in the Jacobian of an arm that is straight,
      and x is 1e17 if it is not: so the answer without such rows comes next.
    - Where the angle between rows is close to rank_tolerance, rounding decides which of them count
      as dependent, and an answer may mix both readings: so tolerances on either side are tried.

    The last two must be certified, for h. The first answer that is replaces x (n,) and the record,
    whose last 3 m + 3 numbers are those of the exact resolver; `name` writes what comes before. If
    none is, x is as it was; or without the small rows, if it was large because of them, for then it
    meets nothing else: rounding in x is more than the tolerance.
    """
    reread = _Reader(h, settings, len(record), name)
    again = reread.at_once(record)
    if again.code == SOLVED:
        again.write(x, record)
        return True
    dust = _dust(h)
    if dust.any():
        clean = _Reader(_without(h, dust), settings, len(record), name).level_by_level()
        if clean.certified_for(h):
            clean.write(x, record)
            return True
        if clean.found and _rests_on(dust, h, x):
            clean.write(x, record)
            return False
    if certify(h, x).certified:
        return True
    for factor in _FACTORS:
        again = reread.level_by_level(factor)
        if again.certified_for(h):
            again.write(x, record)
            return True
    return False


@final
@dataclass(frozen=True)
class _Reader:
    """Solves a hierarchy in other ways; size: that of its record. See `settle_doubt`."""

    h: Hierarchy
    settings: Array
    size: int
    name: Name

    def level_by_level(self, factor: float = 1.0) -> _Reading:
        """Solve without a memory, with another rank_tolerance."""
        settings, x, record = self.settings.copy(), self.h.reference.copy(), np.zeros(self.size)
        settings[_RANK_TOLERANCE] = min(factor * settings[_RANK_TOLERANCE], _LARGEST)
        code = solve_exactly(self.h, x, self._inner(record), settings, False)
        return self._named(_Reading(x, record, code))

    def at_once(self, record: Array) -> _Reading:
        """Solve the active rows of a record in one pass; SOLVED if that is proved."""
        h, x, record = self.h, self.h.reference.copy(), record.copy()
        inner = self._inner(record)
        data, steps = (*h.rows, x), inner[-2]
        code = entry(solve_by_guesses)(*data, inner, self.settings, WORKSPACE.array)
        if code == SOLVED:
            code = run(prove_by_multipliers, *data, h.reference, inner)
        inner[-2] = steps
        return self._named(_Reading(x, record, code))

    def _inner(self, record: Array) -> Array:
        return record[-3 * self.h.m - 3:]

    def _named(self, reading: _Reading) -> _Reading:
        if reading.found:
            self.name(self.h, reading.x, reading.record)
        return reading


@final
@dataclass(frozen=True)
class _Reading:
    """What the exact resolver answers to rows read in another way: x, its record, its code."""

    x: Array
    record: Array
    code: int

    @property
    def found(self) -> bool:
        """Whether there is an answer."""
        return self.code in (SOLVED, INACCURATE)

    def certified_for(self, h: Hierarchy) -> bool:
        """Whether it is the answer of h."""
        return self.found and certify(h, self.x).certified

    def write(self, x: Array, record: Array) -> None:
        """Write it to x (n,) and record."""
        x[:], record[:] = self.x, self.record


def _dust(h: Hierarchy) -> NDArray[np.bool_]:
    """Return which rows (m,) are as small as rounding of another."""
    norms = np.linalg.norm(h.A, axis=1)
    dust: NDArray[np.bool_] = norms < _DUST * norms.max(initial=0.0)
    return dust


def _without(h: Hierarchy, dust: NDArray[np.bool_]) -> Hierarchy:
    """Return h with zeros for these rows."""
    return h.changed(A=np.where(dust[:, None], 0.0, h.A))


def _rests_on(dust: NDArray[np.bool_], h: Hierarchy, x: Array) -> bool:
    """Whether x (n,) is so much larger than all other rows ask for that it rounds their values."""
    sides = np.abs([h.lower, h.upper])[:, ~dust]
    norms = np.linalg.norm(h.A[~dust], axis=1)
    asked = np.where(np.isfinite(sides) & (norms > 0.0), sides, 0.0) / np.where(norms, norms, 1.0)
    usual = 1.0 + float(np.linalg.norm(h.reference)) + float(asked.max(initial=0.0))
    return float(np.finfo(float).eps * np.linalg.norm(x)) > TOLERANCE * usual


_DUST = 1e-13          # norm of a row over the largest: smaller ones may be rounding
_FACTORS = 10.0, 0.1, 3.0, 0.01   # times rank_tolerance
_RANK_TOLERANCE, _LARGEST = 2, 0.1  # its place in the settings; at most
_SOLVED = Status.SOLVED
