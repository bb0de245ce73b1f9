"""Reverse priority: from the lowest level to the highest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, final

import numpy as np

from hierarchy.problem import Array, Hierarchy
from solvers.kernels.reverse import reverse
from solvers.resolver import Resolution, Resolver, register
from solvers.workspace import WORKSPACE, entry

FORMS = ("published", "in-order")


@final
@register
@dataclass(frozen=True, kw_only=True)
class Reverse(Resolver):
    """Each level corrects the answer of the levels below it and disturbs them as little as it can.

    form = "published": the reverse priority of Flacco and De Luca (IROS 2014). A correction weighs
        all levels below alike, so levels from the second on may be missed by more than necessary
        where targets conflict. The first level is always that of the strict answer.
    form = "in-order": a correction disturbs the levels below least in their own order. This gives
        the strict answer.

    Damping applies to every correction and so differs from that of `tpm`; docs/theory/reverse.md
    has the details.

    Source: Flacco, De Luca, "A reverse priority approach to multi-task control of redundant
    robots", IROS 2014.
    """

    name: ClassVar[str] = "reverse"
    damps: ClassVar[str] = "each correction"
    form: str = "published"

    def __post_init__(self) -> None:
        super().__post_init__()
        self._one_of("form", FORMS)

    @property
    def strict(self) -> bool:
        """True for the in-order form, which respects priorities exactly at any rank."""
        return self.form == "in-order"

    @cached_property
    def _settings(self) -> Array:
        return np.array([self.damping, self.threshold, self.rank_tolerance, self.strict])

    @property
    def label(self) -> str:
        """`reverse`, or `reverse in-order`."""
        return f"{self.name} {self.form}" if self.strict else self.name

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h; a direct method that ignores `memory`."""
        x = h.start()
        code = entry(reverse)(*h.rows, x, self._settings, WORKSPACE.array)
        return self._otherwise(h, x, code) if code else Resolution(x)
