"""All joints to a posture."""

from __future__ import annotations

from typing import Literal

from scenarios.config.tasks import Listed, PostureTask, register


@register("posture")
class ListedPosture(Listed, PostureTask):
    """All joints to `target` [rad or m], by default the start; `joints` override it by name."""

    kind: Literal["posture"]
