"""Reverse priority: from the lowest level to the highest."""

from dataclasses import dataclass
from typing import final

from hierarchy.records import set_frozen
from solvers.kernels.reverse import reverse
from solvers.resolver import Direct, one_of, register


@final
@register
@dataclass(frozen=True, kw_only=True)
class Reverse(Direct):
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

    name = "reverse"
    damps = "each correction"
    kernel = staticmethod(reverse)
    form: str = one_of("published", "in-order")

    def __post_init__(self) -> None:
        super().__post_init__()
        set_frozen(self, strict=self.form == "in-order")
