"""Reverse priority: from the lowest level up."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, final

import numpy as np

from hierarchy.problem import Array, Hierarchy
from solvers.kernels.reverse import reverse
from solvers.resolver import Resolution, Resolver, register
from solvers.workspace import WORKSPACE

FORMS = ("published", "in-order")


@final
@register
@dataclass(frozen=True, kw_only=True)
class Reverse(Resolver):
    """Each level corrects what the levels below it chose, and changes them as little as it can.

    form = "published": the reverse priority of Flacco and De Luca, "A reverse priority approach to
    multi-task control of redundant robots" (IROS 2014). A correction weighs all levels below alike.
    The first level is as in the strict answer always. So is x where all targets can be met
    together, at any rank, and of two levels even where they cannot: where every level but the last
    two corrects without touching those below. Elsewhere what it takes is spread over all of them
    in the units of their rows, and levels from the second on may be missed by more than they must.

    form = "in-order": a correction changes the levels below least in their own order. That is the
    strict answer always.

    In both, targets are met from x = 0 and the reference enters at the end as in eq. (14), so that
    it changes no row; with the reference as the lowest answer it would, where levels conflict. With
    damping on, every correction is damped, around the x that it corrects, in its own rows and in
    the rows below (as one level, in-order as several): not what damping is in `tpm`.
    """

    name: ClassVar[str] = "reverse"
    form: str = "published"

    def __post_init__(self) -> None:
        super().__post_init__()
        self._one_of("form", FORMS)

    @property
    def strict(self) -> bool:
        """Whether priorities are respected exactly at any rank: in the form in-order."""
        return self.form == "in-order"

    @cached_property
    def _settings(self) -> Array:
        return np.array([self.damping, self.threshold, self.rank_tolerance, self.strict])

    @property
    def label(self) -> str:
        """`reverse`, or `reverse in-order`."""
        return f"{self.name} {self.form}" if self.strict else self.name

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h; direct, `memory` is not used."""
        x = h.reference.copy()
        code = reverse(h.A, h.lower, h.upper, h.sizes, x, self._settings, WORKSPACE.array)
        return self._otherwise(h, x, code) if code else Resolution(x)
