"""`Resolution`: the result of a solve."""

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError, expect, number
from hierarchy.gate import shaped
from hierarchy.notebook import html_table, numbers
from hierarchy.problem import Array, Hierarchy
from solvers.kernels.active_set.exact import verify_answer
from solvers.status import SOLVED, Status
from solvers.workspace import run


class Resolution:
    """The result of a solve.

    x : (n,) the answer, always finite.
    status : how the solve ended.
    iterations : number of iterations, counted in the resolver's own way; 1 for a direct resolver.
    memory : warm start for the next solve, in the resolver's own layout; None if it keeps none.
    witnesses : (K, n), for each level that gives an x of its least miss, see solvers.give; else
        None.
    """

    __slots__ = ("_states", "iterations", "memory", "status", "witnesses", "x")

    def __init__(self, x: Array, status: Status = Status.SOLVED, iterations: int = 1,
                 memory: Array | None = None, active: NDArray[Any] | None = None) -> None:
        self.x = x
        self.status = status
        self.iterations = iterations
        self.memory = memory
        self.witnesses: Array | None = None
        self._states = active

    @property
    def active(self) -> NDArray[np.int8] | None:
        """State of each row (m,), values of `solvers.status.Row`; None if it is not reported."""
        return None if self._states is None else self._states.astype(np.int8)

    def verified(self, h: Hierarchy, rank_tolerance: float = 1e-8) -> bool:
        """Whether x and the active rows prove each other on the data of h; `th_verify` in C.

        The check of docs/theory/hcod.md, from nothing but h, x and `active`: multipliers and signs
        of every level. False too for an answer with damping, which is optimal for other data, and
        for some 3 in 1000 SOLVED ones with dependent active rows: other multipliers prove them.

        Raises HierarchyError for a hierarchy with a metric or with levels that give, and for a
        resolver that reports no active rows; `certify(h, x)` judges these. And for one of other
        rows or unknowns than this resolution.
        """
        expect("verified: h", h, Hierarchy, "give the one that was resolved")
        number("verified: rank_tolerance", rank_tolerance, 0.0, 1.0)
        active = self.active
        if active is None and (h.lower == h.upper).all():
            active = np.zeros(h.m, dtype=np.int8)
        if active is None or not h.plain:
            why = "no active rows are reported" if h.plain else "h has a metric or levels that give"
            raise HierarchyError(f"verified: {why}; certify(h, x) judges such an answer")
        settings = np.array([0.0, 0.0, rank_tolerance])
        x = np.concatenate([shaped("verified: x", self.x, (h.n,)), h.reference])
        states = shaped("verified: active", active, (h.m,))
        return run(verify_answer, *h.rows, x, states, settings) == SOLVED

    def __repr__(self) -> str:
        return (f"{type(self).__name__}({self.status.name}, x={numbers(self.x)}, "
                f"iterations={self.iterations})")

    def _repr_html_(self) -> str:
        rows = [("status", self.status), ("x", numbers(self.x)), ("iterations", self.iterations),
                ("memory", "none" if self.memory is None else f"{self.memory.size} numbers")]
        return html_table(type(self).__name__, (), rows)


@final
class SaturatedResolution(Resolution):
    """A resolution within bounds; its record (n + L + ..) starts with saturation and scaling.

    Attributes in addition to those of `Resolution`; n unknowns, L levels
    ----------
    saturated : (n,) int8, +1 for an unknown that its upper bound holds, -1 its lower bound, 2 where
        the two are equal, 0 for others, even one that lies at a bound and would stay there.
    scaling : (L,) share of its target that each level reaches, 0 to 1; 1 for bounds that do not
        contradict each other. Each resolver documents how it computes the share.
    """

    __slots__ = ("_levels", "_record")

    def __init__(self, x: Array, status: Status, iterations: int, record: Array, levels: int,
                 memory: Array | None = None) -> None:
        self.x, self.status, self.iterations, self.memory = x, status, iterations, memory
        self.witnesses = self._states = None
        self._record, self._levels = record, levels

    @property
    def saturated(self) -> NDArray[np.int8]:
        """Which unknowns a bound holds: (n,)."""
        return self._record[:len(self.x)].astype(np.int8)

    @property
    def scaling(self) -> Array:
        """Share of its target that each level reaches: (L,)."""
        n = len(self.x)
        return self._record[n:n + self._levels].copy()
