"""The standard recursion with null-space projections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, final

from hierarchy.problem import Hierarchy
from solvers.kernels.recursion import recursion
from solvers.resolver import Resolution, Resolver, register
from solvers.workspace import WORKSPACE


@final
@register
@dataclass(frozen=True, kw_only=True)
class Recursive(Resolver):
    """Level after level in the null space of those above, eqs. (5)-(6), (13) and (14).

    With damping on, the pseudoinverse of (5) is damped and the projector (6) is not: the same x as
    `tpm`, to rounding.
    """

    name: ClassVar[str] = "recursive"

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h; direct, `memory` is not used."""
        x = h.reference.copy()
        code = recursion(h.A, h.lower, h.upper, h.sizes, x, self._settings, WORKSPACE.array)
        return self._otherwise(h, x, code, memory) if code else Resolution(x)
