"""The exact resolver: lexicographic least squares with inequalities at every level."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isnan
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array, Hierarchy
from solvers.kernels.active_set.exact import solve_damped, solve_equalities, solve_hierarchy
from solvers.kernels.give import solve_giving
from solvers.resolver import Resolution, Resolver, number, register, whole_number
from solvers.status import ITERATION_LIMIT, NUMERICAL_FAILURE, SOLVED, TOO_SMALL, UNPROVED, Status
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
        Below levels that leave no freedom, and of zeros, a violated inequality counts as inactive.
    unfinished : the level at which the iteration limit was reached, or None.
    """

    __slots__ = ("record",)

    memory: Array

    def __init__(self, x: Array, status: Status, record: Array) -> None:
        self.x, self.status, self.witnesses = x, status, None  # half the time of super().__init__
        self.memory = self.record = record

    def __getstate__(self) -> tuple[None, dict[str, Any]]:
        """What is kept; `iterations`, which the class above keeps, is worked out here."""
        kept = ("x", "status", "witnesses", "memory", "record")
        return None, {name: getattr(self, name) for name in kept}

    @property
    def iterations(self) -> int:  # type: ignore[override]
        """Active sets tried, plus active-set steps level by level."""
        return int(self.record[-3] + self.record[-2])

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
        limited = self.status is Status.ITERATION_LIMIT
        return max(0, int(self.record[-1])) if limited else None

    def _part(self, which: int) -> Array:
        return np.asarray(self.record[:-3].reshape(3, -1)[which])


@final
@register
@dataclass(frozen=True, kw_only=True)
class Hcod(Resolver):
    """Active-set method on a hierarchical factorisation; exact at any rank, with inequalities.

    Not the decomposition of Escande, Mansard and Wieber; docs/theory/hcod.md says how it
    differs, and describes the method and its checks.

    Equalities alone give the answer of `tpm`, to the last digit. An answer is SOLVED only if its
    working set and multipliers verify it on the data, otherwise INACCURATE.

    tolerance : of violations, relative to the size of the terms in them.
    max_iterations : working sets tried before Status.ITERATION_LIMIT, never exceeded.
    """

    name = "hcod"
    handles = "inequalities"
    damps_with_bounds = "each level, without what bounds hold"
    tolerance: float = number(1e-10, high=1e-3, open_below=True)
    max_iterations: int = whole_number(1000, 1)

    def solve(self, h: Hierarchy, memory: Array | None = None) -> ActiveSetResolution:
        """Resolve h, starting from the working set of an earlier resolution if given."""
        x, record = h.start(), warm_record(memory, 3 * h.m + 3)
        code = solve_exactly(h, x, record, self)
        return ActiveSetResolution(x, _SOLVED if code == SOLVED else Status(code), record)

    def _solve_giving(self, h: Hierarchy, memory: Array | None) -> Resolution:
        """Resolve h, some levels of which give, in one call of a kernel.

        The memory is that of all solves. Where the limit ends that for a witness, it is reported.
        """
        if h.metric is not None or self.damping > 0.0:
            return super()._solve_giving(h, memory)
        levels, n, m = h.giving, h.n, h.m
        count, size = len(levels), 3 * m + 3
        part = 3 * int(h.offsets[levels[-1] + 1]) + 3
        x = np.empty(n + m + count * n)
        x[:n], x[n:n + m], x[-1] = h.reference, h.give, np.nan
        record = warm_record(memory, count * part + size)
        code = run(entry(solve_giving), *h.rows, x, record, self._settings)
        status, reported = _SOLVED if code == SOLVED else Status(code), record[-size:]
        if (unfound := isnan(x.item(-1))) and code == ITERATION_LIMIT:
            parts = record[:-size].reshape(count, part)
            reported = parts[parts[:, -3:-1].any(axis=1)][-1]
        found: Resolution = ActiveSetResolution(x[:n].copy(), status, reported)
        found.memory = None if code == NUMERICAL_FAILURE else record
        found.witnesses = None if unfound else x[n + m:].reshape(count, n)
        return found


def warm_record(memory: Array | None, size: int) -> Array:
    """Return a record (size,) for the kernels that continues a memory; zeros without one."""
    return np.zeros(size) if memory is None or memory.size != size else memory.flatten()


def solve_exactly(h: Hierarchy, x: Array, record: Array, resolver: Hcod) -> int:
    """Solve with the exact kernel, in a work space that is large enough; return its code.

    x (n,) is the reference on entry and the answer on return.
    """
    A, lower, upper, sizes = h.rows  # `*h.rows` takes 60 ns more
    settings, damped = resolver._settings, resolver.damping > 0.0
    solve = _kernels.get(damped) or _kernels.setdefault(damped, entry(solve_equalities))
    while (code := solve(A, lower, upper, sizes, x, record, settings, WORKSPACE.array)) in _AGAIN:
        if code == TOO_SMALL:
            WORKSPACE.double()
        else:
            solve = _kernels[damped] = entry(solve_damped if damped else solve_hierarchy)
    return code


_AGAIN = TOO_SMALL, UNPROVED
_kernels: dict[bool, Callable[..., int]] = {}  # by whether damped: of equalities, until more came
_SOLVED = Status.SOLVED
