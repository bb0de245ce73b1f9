"""Strict levels for what must hold, one weighted level with a memory for all that follows."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Self, cast, final

import numpy as np

from hierarchy.errors import HierarchyError, positive
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from solvers.kernels.merged import (
    BY_RULE,
    EXACT,
    NOTHING,
    OWN,
    count_strict,
    merged,
    record_size,
    write_levels,
)
from solvers.resolver import Resolution, Resolver, number, register, whole_number
from solvers.resolvers.hcod import Hcod, warm_record
from solvers.status import SOLVED, Status
from solvers.workspace import entry, run

_SOLVED = Status.SOLVED  # a look-up takes twice the time


@final
class MergedResolution(Resolution):
    """A resolution whose memory is y (m,), the iterations, and a working set."""

    __slots__ = ("_carried",)

    def __init__(self, x: Array, status: Status, memory: Array, m: int) -> None:
        super().__init__(x, status, int(memory[m]), memory, memory[m + 1:2 * m + 1])
        self._carried = memory[:m]

    @property
    def carried(self) -> Array:
        """By how much the sides of each row move in the next solve: (m,), in its unit."""
        return self._carried.copy()


@dataclass(frozen=True, kw_only=True)
class OneLevel(Resolver):
    """A resolver that makes one weighted level of all levels below the strict ones.

    tolerance, max_iterations : as in `hcod`, which solves.
    """

    handles = "inequalities"
    strict = False
    damps = "the weighted level as a whole, about the reference"
    damps_with_bounds = damps
    tolerance: float = number(Hcod.tolerance, high=1e-3, open_below=True)
    max_iterations: int = whole_number(Hcod.max_iterations, 1)

    def solve(self, h: Hierarchy, memory: Array | None = None) -> MergedResolution:
        """Resolve h, continuing an earlier resolution if given.

        Raises HierarchyError if every level is strict, so that none is left to merge.
        """
        x, m = h.start(), h.m
        record = warm_record(memory, record_size(h.n, m))
        code = run(entry(merged), *h.rows, x, record, self._settings_of(h))
        if code == NOTHING:
            refuse_safety_alone(self, h)
        return MergedResolution(x, _SOLVED if code == SOLVED else Status(code), record, m)

    def strictly(self) -> Hcod:
        """Return the resolver with these settings for which all levels are strict."""
        return Hcod(damping=self.damping, threshold=self.threshold, tolerance=self.tolerance,
                    rank_tolerance=self.rank_tolerance, max_iterations=self.max_iterations)

    def below_one_more(self, h: Hierarchy) -> Self:
        """Return the resolver for the levels of h below one more, which is strict too."""
        strict = int(count_strict(*h.rows[1:], self._settings_of(h)[EXACT]))
        made: Self = cast(Any, replace)(self, strict_levels=strict + 1)
        return made

    def aimed(self, h: Hierarchy, memory: Array | None) -> Hierarchy:
        """Return h with the sides that its rows aim at after an earlier resolution."""
        y, _ = self._moves(h, memory)
        return h.changed(lower=h.lower + y, upper=h.upper + y)

    def carried_on(self, h: Hierarchy, x: Array, memory: Array | None) -> Array:
        """Return the memory after an answer x (n,) that was found in another way."""
        (y, cap), record = self._moves(h, memory), warm_record(None, record_size(h.n, h.m))
        value = h.A @ x
        miss = np.clip(value - y, h.lower, h.upper) - value
        step = self._settings_of(h)[EXACT + 2]
        record[:h.m] = np.clip(y + step * np.clip(miss, -cap, cap), -cap, cap)
        return record

    def _moves(self, h: Hierarchy, memory: Array | None) -> tuple[Array, Array]:
        """Return by how much a memory moves the sides of each row, and at most: (m,) both."""
        settings, levels = self._settings_of(h), len(h.names)
        caps = settings[OWN + levels:].copy()
        caps[:count_strict(*h.rows[1:], settings[EXACT])] = caps[-1:] = 0.0
        cap, y = np.repeat(caps, h.sizes), warm_record(memory, record_size(h.n, h.m))[:h.m]
        return np.clip(np.where(np.isfinite(y), y, 0.0), -cap, cap), cap

    @cached_property
    def _known(self) -> dict[tuple[str, ...], Array]:
        """Cache of `_settings_for`."""
        return {}

    def _settings_of(self, h: Hierarchy) -> Array:
        """Return the settings of the kernel for h."""
        if h.names not in self._known:
            self._known[h.names] = self._settings_for(h.names)
        return self._known[h.names]

    @abstractmethod
    def _settings_for(self, names: tuple[str, ...]) -> Array:
        """Return the settings of the kernel for levels of these names."""

    def _packed(self, strict: float, regularisation: float, step: float, weights: Array) -> Array:
        """Return the settings of the kernel in their order."""
        return np.array([self.damping, self.threshold, self.rank_tolerance, self.tolerance,
                         self.max_iterations, strict, regularisation, step, *weights])


@final
@register
@dataclass(frozen=True, kw_only=True)
class Merged(OneLevel):
    """Strict for limits, weighted below, with a memory that meets upper levels at rest.

    The levels of the tasks become one weighted level below the strict ones, so x moves no faster
    than the data where the strict optimum jumps. What a task misses moves its target in the next
    solve, by at most `cap`: where all rests, upper levels are met as under strict priorities, see
    docs/theory/merged.md. Without a memory this is a weighted sum.

    ratio : weight of a level over that of the level below; the lowest level has weight 1.
    scales : by name of a level, the miss [unit of its rows] that counts as 1; 1 where not given.
    cap : most that a target moves, times the scale of its level; not in the lowest level.
    step : share of a miss, at most 1, by which the target moves in the next solve; what a miss has
        beyond the cap does not count.
    strict_levels : levels that stay strict; None: the first run of inequalities, and all above.
    regularisation : weight of |x - reference|, for unknowns that no merged equality names alone.
    """

    name = "merged"
    ratio: float = number(4.0, 1.0, 1e6)
    scales: Mapping[str, float] | tuple[tuple[str, float], ...] = ()
    cap: float = number(1.0)
    step: float = number(0.1, high=np.nextafter(1.0, 2.0), open_below=True)
    strict_levels: int | None = whole_number(None, 0)
    regularisation: float = number(1e-3)

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            pairs = dict(self.scales)
        except (TypeError, ValueError) as error:
            raise HierarchyError(f"merged: scales = {self.scales!r}, expected numbers > 0 by a "
                                 "level's name") from error
        set_frozen(self, scales=tuple((name, positive(f"merged: scales: {name!r}", scale))
                                      for name, scale in pairs.items()))  # which can be hashed

    @property
    def label(self) -> str:
        """`merged`, with a ratio and a cap other than the default."""
        ratio = "" if self.ratio == Merged.ratio else f" {self.ratio:g}"
        return self.name + ratio + ("" if self.cap == Merged.cap else f" cap {self.cap:g}")

    def _settings_for(self, names: tuple[str, ...]) -> Array:
        scales, strict = dict(self.scales), self.strict_levels
        settings = self._packed(BY_RULE if strict is None else strict, self.regularisation,
                                self.step, np.empty(2 * len(names)))
        write_levels(settings, self.ratio, self.cap,
                     np.array([scales.get(name, 1.0) for name in names]))
        return settings


def refuse_safety_alone(resolver: OneLevel, h: Hierarchy) -> None:
    """Raise a HierarchyError: every level of h is strict."""
    raise HierarchyError(f"{resolver.name}: all levels stay strict ({', '.join(h.names)}) and none "
                         "is left to merge; set strict_levels, or use hcod")
