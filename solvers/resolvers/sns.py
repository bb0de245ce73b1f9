"""Saturation in the null space: hard bounds on single unknowns, and tasks scaled to fit them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, final

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.kernels.sns import sns
from solvers.resolver import Handles, Resolution, Resolver, register
from solvers.resolvers.saturation import SaturatedResolution
from solvers.status import CONTRADICTION, TOO_SMALL, Status
from solvers.workspace import WORKSPACE

FORMS = ("basic", "optimal")
SCALES = ("target", "miss")


@final
@register
@dataclass(frozen=True, kw_only=True)
class Sns(Resolver):
    """Saturation in the null space, inside a box given by the rows of the first level.

    The first level holds one- or two-sided bounds on single unknowns, or else nowhere is an
    inequality; then this is `tpm`, to the last digit. Task after task, in the null space of those
    above and beginning with all joints: while the answer leaves the box, the most critical joint is
    set to its bound and the others make up for it. When that has cost the task its rank, the set of
    saturated joints with the largest scaling s is taken.

    form = "basic": as published. Joints once saturated stay so for the task. The null-space term is
    the last task: x goes along P reference, and where the box stops a joint, on without it.

    form = "optimal": as published, a saturated joint is released where the multiplier of the least
    ||x_k - x_{k-1}|| has the wrong sign, for at most 2 n + 2 sets a task. Not published: the last
    task ends at the x in the box nearest to the reference among those that change no level.

    scales = "target": as published, a scaled task reaches s b, the direction of b kept. At
    acceleration level b has the drift in it, and s scales that too. Where tasks above that are
    saturated already move along a task, there often is no s, and the task adds nothing.

    scales = "miss": a scaled task makes up for the share s of what the tasks above leave it to
    miss. There always is an s. For the first task the same as "target".

    Always: x is in the box, and the values of upper levels stay as lower ones are added. Where no
    joint is ever at a bound, x is that of `recursive`. Not optimal: s is the largest of the sets
    tried, and the box may allow more; it is not the least violation, which `hcod` finds; and no
    level looks at those below it.

    Unlike the paper, a task that adds nothing still keeps its rows from the levels below, a task
    may have dependent rows (its rank is that without saturation), x_0 is the point of the box
    nearest to zero, and where a joint comes into the box only beyond s = 1 it is the critical one.

    Damping is that of `recursive`, with saturated joints counted as levels above. Sources: Flacco,
    De Luca, Khatib, "Motion control of redundant robots under joint constraints", ICRA 2012,
    algorithms 1 (one task) and 2 (s); "Prioritized multi-task motion control of redundant robots
    under hard joint constraints", IROS 2012; "Control of redundant robots under hard joint
    constraints: saturation in the null space", T-RO 31(3), 2015.

    Raises
    ------
    HierarchyError : another inequality, or bounds of one unknown that exclude each other.
    """

    name: ClassVar[str] = "sns"
    handles: ClassVar[Handles] = "bounds"
    form: str = "basic"
    scales: str = "target"

    def __post_init__(self) -> None:
        super().__post_init__()
        self._one_of("form", FORMS)
        self._one_of("scales", SCALES)

    @property
    def label(self) -> str:
        """`sns`, with what is not published as "basic" or as scaling."""
        form = "" if self.form == "basic" else f" {self.form}"
        return self.name + form + ("" if self.scales == "target" else f" {self.scales}")

    @cached_property
    def _settings(self) -> Array:
        return np.array([self.damping, self.threshold, self.rank_tolerance,
                         self.form == "optimal", self.scales == "miss"], dtype=float)

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h; `memory` is not used. Gives a `SaturatedResolution`."""
        x = h.reference.copy()
        record = np.empty(len(x) + len(h.sizes) + 1)
        code = sns(h.A, h.lower, h.upper, h.sizes, x, record, self._settings, WORKSPACE.array)
        if code == CONTRADICTION:
            _refuse_contradiction(h, int(record[-1]))
        if code < 0 or code == TOO_SMALL:
            return self._otherwise(h, x, code)
        return SaturatedResolution(x, Status(code), int(record[-1]), record, len(h.sizes))


def _refuse_contradiction(h: Hierarchy, row: int) -> None:
    unknown = int(np.flatnonzero(h.A[row])[0])
    raise HierarchyError(
        f"{h.names[0]}, row {row}: {h.lower[row]:g} <= {h.A[row, unknown]:g} x[{unknown}] <= "
        f"{h.upper[row]:g} leaves nothing of what the rows above it allow x[{unknown}]")
