"""All levels merged into one, for comparison."""

from dataclasses import dataclass
from typing import final

from solvers.kernels.staircase import solve_as_one
from solvers.resolver import Direct, register


@final
@register
@dataclass(frozen=True, kw_only=True)
class Augmented(Direct):
    """The least-squares solution of the whole stack, eqs. (2) and (14), without priorities.

    It equals the strict answer only where all levels can be met together. Damping treats the whole
    stack as one level.
    """

    name = "augmented"
    damps = "the whole stack"
    strict = False  # lower levels can disturb higher ones
    kernel = staticmethod(solve_as_one)
