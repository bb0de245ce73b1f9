"""A frame on or in a cone."""

from __future__ import annotations

from typing import Literal

from scenarios.config.tasks import Listed, PointingTask, register


@register("pointing")
class ListedPointing(PointingTask, Listed):
    """The z axis of `frame` at `alpha_d` [deg] from `axis`, or with "inequality" at most that."""

    kind: Literal["pointing"]
    frame: str  # type: ignore[misc]
