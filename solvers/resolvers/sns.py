"""Saturation in the null space: hard bounds on single unknowns, tasks scaled to fit."""

from dataclasses import dataclass
from typing import final

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.kernels.sns import sns
from solvers.resolution import SaturatedResolution
from solvers.resolver import Resolution, Resolver, one_of, place_of, register
from solvers.status import CONTRADICTION, TOO_SMALL, Status
from solvers.workspace import WORKSPACE


@final
@register
@dataclass(frozen=True, kw_only=True)
class Sns(Resolver):
    """Saturation in the null space, inside a box given by the rows of the first level.

    The first level holds one- or two-sided bounds on single unknowns; without any inequality the
    answer is that of `recursive`. x stays inside the box, and lower tasks do not
    change the values of upper levels. The answer is not optimal: it depends on the sets of
    saturated joints that were tried. Algorithm, departures and sources:
    docs/theory/sns.md.

    form : "basic" keeps a saturated joint saturated for the task; "optimal" releases it where its
        multiplier has the wrong sign, and ends at the x nearest to the reference.
    scales : "target" scales the target of a task; "miss" scales what the tasks above leave to do.

    Raises HierarchyError for any other inequality, and for bounds on one unknown that contradict
    each other.
    """

    name = "sns"
    handles = "bounds"
    damps_with_bounds = "each task on the joints that are not saturated"
    form: str = one_of("basic", "optimal")
    scales: str = one_of("target", "miss")

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h and return a `SaturatedResolution`; `memory` is ignored."""
        x, levels = h.start(), len(h.names)
        record = np.empty(len(x) + levels + 1)
        code = sns(*h.rows, x, record, self._settings, WORKSPACE.array)
        if code == CONTRADICTION:
            row = int(record[-1])
            unknown = int(np.flatnonzero(h.A[row])[0])
            raise HierarchyError(
                f"{place_of(h, row)}: {h.lower[row]:g} <= {h.A[row, unknown]:g} x[{unknown}] "
                f"<= {h.upper[row]:g} leaves nothing of the range that the rows above allow for "
                f"x[{unknown}]")
        if code < 0 or code == TOO_SMALL:
            return self._otherwise(h, x, code)
        return SaturatedResolution(x, Status(code), int(record[-1]), record, levels)
