"""All levels as one, for comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, final

from hierarchy.problem import Hierarchy
from solvers.kernels.staircase import solve_by_staircase
from solvers.resolver import Resolution, Resolver, register
from solvers.status import INACCURATE, SOLVED
from solvers.workspace import WORKSPACE


@final
@register
@dataclass(frozen=True, kw_only=True)
class Augmented(Resolver):
    """The least-squares solution of the whole stack, eqs. (2) and (14): priorities play no role.

    It is the strict answer only where all levels can be met together. With damping on, the whole
    stack is damped as one level.
    """

    name: ClassVar[str] = "augmented"

    @property
    def strict(self) -> bool:
        """No: a lower level may take from a higher one."""
        return False

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h; direct, `memory` is not used."""
        x, whole = h.reference.copy(), h.offsets[-1:]  # one level of m rows
        code = solve_by_staircase(h.A, h.lower, h.upper, whole, x, self._settings,
                                  WORKSPACE.array)
        return Resolution(x) if code in (SOLVED, INACCURATE) else self._otherwise(h, x, code)
