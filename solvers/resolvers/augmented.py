"""All levels merged into one, for comparison."""

from dataclasses import dataclass
from typing import final

from hierarchy.problem import Array, Hierarchy
from solvers.kernels.staircase import solve_as_one
from solvers.resolver import Resolution, Resolver, register
from solvers.workspace import WORKSPACE, entry


@final
@register
@dataclass(frozen=True, kw_only=True)
class Augmented(Resolver):
    """The least-squares solution of the whole stack, eqs. (2) and (14), without priorities.

    It equals the strict answer only where all levels can be met together. Damping treats the whole
    stack as one level.
    """

    name = "augmented"
    damps = "the whole stack"
    strict = False  # lower levels can disturb higher ones

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h; a direct method that ignores `memory`."""
        x, whole = h.start(), h.offsets[-1:]  # one level of m rows
        A, lower, upper, _ = h.rows
        code = entry(solve_as_one)(A, lower, upper, whole, x, self._settings, WORKSPACE.array)
        return self._otherwise(h, x, code) if code else Resolution(x)
