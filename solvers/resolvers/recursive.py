"""The standard recursion with null-space projections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, final

from hierarchy.problem import Array, Hierarchy
from solvers.kernels.recursion import recursion
from solvers.resolver import Resolution, Resolver, register
from solvers.workspace import WORKSPACE


@final
@register
@dataclass(frozen=True, kw_only=True)
class Recursive(Resolver):
    """Level by level in the null space of the levels above, eqs. (5)-(6), (13) and (14).

    Damping applies to the pseudoinverse of (5), not to the projector (6); x is then that of `tpm`,
    up to rounding.
    """

    name: ClassVar[str] = "recursive"

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h; a direct method that ignores `memory`."""
        x = h.reference.copy()
        code = recursion(h.A, h.lower, h.upper, h.sizes, x, self._settings, WORKSPACE.array)
        return self._otherwise(h, x, code, memory) if code else Resolution(x)
