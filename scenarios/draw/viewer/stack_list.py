"""The stack as a list: which tasks are active, given up or absent, which joints saturated."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

import numpy as np

from scenarios.draw.viewer.moment import Became, Moment
from scenarios.loop.fate import Fate
from scenarios.loop.phrases import PHRASES, phrase

_PILLS = {  # text colour, background
    Fate.MET: ("#0a6b4f", "#d9f2e8"), Fate.FREE: ("#5b6470", "#eceff2"),
    Fate.MISSED: ("#9a2417", "#fbe0dc"), Fate.UNKNOWN: ("#5b6470", "#eceff2"),
    Fate.ABSENT: ("#a3abb5", "transparent")}
_SATURATED = ("#8a5300", "#fdeccb")


def stack_html(label: str, colour: str, now: Moment, tasks: Iterable[str] = (),
               note: str = "") -> str:
    """Return the list at a moment: the stack in its order, then the other `tasks` in grey."""
    saturated = _saturated(now)
    rows = [_row(str(i), name, *_state(now.became[name]), colour)
            for i, name in enumerate(now.order, 1)]
    absent = _row("", "", PHRASES[Fate.ABSENT], Fate.ABSENT, colour)
    rows += [absent.replace("<b></b>", f"<span style='color:#a3abb5'>{escape(name)}</span>")
             for name in tasks if name not in now.order]
    if saturated:
        rows.append(f"<div style='margin-top:5px'>{_pill(saturated, *_SATURATED)}</div>")
    return (f"<div style='padding:0 14px 8px;font-size:13px;line-height:1.35'>"
            f"<div style='border-left:4px solid {colour};padding-left:8px;margin-bottom:5px'>"
            f"<b>{escape(label)}</b> <span style='color:#6b7480'>{escape(note)}</span></div>"
            f"{''.join(rows)}</div>")


def _row(number: str, name: str, text: str, fate: Fate, colour: str) -> str:
    return ("<div style='display:flex;gap:8px;align-items:baseline;padding:2px 0'>"
            f"<span style='width:1em;text-align:right;color:{colour}'>{number}</span>"
            f"<span style='flex:1'><b>{escape(name)}</b></span>{_pill(text, *_PILLS[fate])}</div>")


def _pill(text: str, colour: str, background: str) -> str:
    return (f"<span style='color:{colour};background:{background};border-radius:8px;"
            f"padding:1px 8px;font-variant-numeric:tabular-nums'>{escape(text)}</span>")


def _state(became: Became) -> tuple[str, Fate]:
    """Return the text and the fate of a task in the stack."""
    return phrase(became.fate, became.violation), became.fate


def _saturated(now: Moment) -> str:
    """Return the text about joints at a limit."""
    sides = {1: "upper", -1: "lower"}
    joints = [f"{j + 1} ({sides[int(now.saturated[j])]})" for j in np.flatnonzero(now.saturated)]
    return f"saturated: joint {', '.join(joints)}" if joints else ""
