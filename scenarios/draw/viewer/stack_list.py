"""The stack as a list: which tasks are active, given up or absent, which joints saturated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from scenarios.draw.viewer.model import PUSHES
from scenarios.draw.viewer.moment import Moment
from scenarios.recording.fate import PHRASES, Fate, phrase
from scenarios.templates import render

_COLOURS = {  # of a text and its background
    Fate.MET: ("#0a6b4f", "#d9f2e8"), Fate.FREE: ("#5b6470", "#eceff2"),
    Fate.MISSED: ("#9a2417", "#fbe0dc"), Fate.UNKNOWN: ("#5b6470", "#eceff2"),
    Fate.ABSENT: ("#a3abb5", "transparent")}
_SATURATED = ("#8a5300", "#fdeccb")


def stack_html(label: str, colour: str, now: Moment, tasks: Iterable[str] = (),
               note: str = "", goals: Iterable[object] = ()) -> str:
    """Return the list at a moment: the stack in its order, then the other `tasks` in grey.

    Above stand the `goals` of the run.
    """
    became = [now.became[name] for name in now.order]
    return str(render(
        "draw/viewer/stack_list.html", label=label, colour=colour, note=note, goals=goals,
        stack=[(name, phrase(*one), _COLOURS[one.fate])
               for name, one in zip(now.order, became, strict=True)],
        absent=[name for name in tasks if name not in now.order],
        not_in_stack=(PHRASES[Fate.ABSENT], _COLOURS[Fate.ABSENT]),
        joints=_at_limits(now), saturated=_SATURATED))


def key_html(words: Mapping[str, str], colour: str) -> str:
    """Return what the lines at contacts mean, `words` by the fields of Pushes."""
    return str(render("draw/viewer/key.html", lines=[
        (PUSHES[name][0] or colour, PUSHES[name][1], text) for name, text in words.items()]))


def _at_limits(now: Moment) -> list[str]:
    """Return the number and the side of each joint at a limit."""
    sides = {1: "upper", -1: "lower"}
    return [f"{j + 1} ({sides[int(now.saturated[j])]})" for j in np.flatnonzero(now.saturated)]
