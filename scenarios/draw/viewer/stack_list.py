"""The stack as a list: which tasks are active, given up or absent, which joints saturated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from scenarios.draw.viewer.model import PUSHES
from scenarios.draw.viewer.moment import Moment
from scenarios.recording.fate import PHRASES, Fate, phrase
from scenarios.scene import Stage
from scenarios.templates import render

_COLOURS = {  # of a text and its background
    Fate.MET: ("#0a6b4f", "#d9f2e8"), Fate.FREE: ("#5b6470", "#eceff2"),
    Fate.MISSED: ("#9a2417", "#fbe0dc"), Fate.UNKNOWN: ("#5b6470", "#eceff2"),
    Fate.ABSENT: ("#a3abb5", "transparent")}
_ON_CONE = 0.05  # [deg] beyond the cone that still counts as being on it
_SATURATED = ("#8a5300", "#fdeccb")


def stack_html(label: str, colour: str, now: Moment, tasks: Iterable[str] = (),
               note: str = "", stage: Stage | None = None) -> str:
    """Return the list at a moment: the stack in its order, then the other `tasks` in grey.

    With the stage of a scenario that has a cone, it begins with where the tool is to that goal.
    """
    became = [now.became[name] for name in now.order]
    return str(render(
        "draw/viewer/stack_list.html", label=label, colour=colour, note=note,
        cone=_of_cone(now, stage),
        stack=[(name, phrase(one.fate, one.violation), _COLOURS[one.fate])
               for name, one in zip(now.order, became, strict=True)],
        absent=[name for name in tasks if name not in now.order],
        not_in_stack=(PHRASES[Fate.ABSENT], _COLOURS[Fate.ABSENT]),
        joints=_at_limits(now), saturated=_SATURATED))


def _of_cone(now: Moment, stage: Stage | None) -> tuple[str, tuple[str, str]] | None:
    """Return how far the tool's axis is inside or outside its cone, if any, and the colours."""
    if stage is None or stage.axis is None:
        return None
    angle = np.degrees(np.arccos(np.clip(now.axis @ stage.axis, -1.0, 1.0)))
    beyond = float(angle - np.degrees(stage.half_angle))
    if beyond > _ON_CONE:
        return f"{beyond:.1f}° outside", _COLOURS[Fate.MISSED]
    return f"inside, {max(-beyond, 0.0):.1f}° left", _COLOURS[Fate.MET]


def key_html(words: Mapping[str, str], colour: str) -> str:
    """Return what the lines at contacts mean, `words` by the fields of Pushes."""
    return str(render("draw/viewer/key.html", lines=[
        (PUSHES[name][0] or colour, PUSHES[name][1], text) for name, text in words.items()]))


def _at_limits(now: Moment) -> list[str]:
    """Return the number and the side of each joint at a limit."""
    sides = {1: "upper", -1: "lower"}
    return [f"{j + 1} ({sides[int(now.saturated[j])]})" for j in np.flatnonzero(now.saturated)]
