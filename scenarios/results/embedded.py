"""The replay embedded in the report, drawn only once it scrolls into view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from markupsafe import Markup

from hierarchy.errors import HierarchyError
from hierarchy.words import in_words, listed
from scenarios.measure.motions import Motion
from scenarios.templates import render

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording

MOST = 4  # motions in one replay
_FASTEST, _SLOWEST = 30.0, 5.0  # [Hz] of the frames kept


def replay(name: str, found: Sequence[Motion], most_bytes: int) -> Markup:
    """Return the section with the replay of up to MOST motions.

    The frame rate is lowered if the replay would exceed `most_bytes`.
    """
    shown = list(found[:MOST])
    try:
        document, rate = _document(name, shown, most_bytes)
    except HierarchyError as error:
        return render("results/replay.html", problem=str(error), said="")
    return render("results/replay.html", name=name, document=document, problem="",
                  said=_said(shown, found, rate))


def _document(name: str, shown: Sequence[Motion], most_bytes: int) -> tuple[str, float]:
    from scenarios.draw.replay import html

    recordings: dict[str, Recording] = {one.label: one.recording for one in shown}
    document, rate = html(recordings, name, rate=_FASTEST, embedded=True), _FASTEST
    if len(document) > most_bytes:
        rate = max(_SLOWEST, float(int(_FASTEST * most_bytes / len(document))))
        document = html(recordings, name, rate=rate, embedded=True)
    return document, rate


def _said(shown: Sequence[Motion], found: Sequence[Motion], rate: float) -> str:
    """Return which runs are shown and which move in the same way."""
    said = f"Shown: {listed([one.label for one in shown])}, {rate:g} frames per second."
    for one in shown:
        if len(one.runs) > 1:
            moves = "moves" if len(one.runs) == 2 else "move"
            said += f" {listed(one.labels[1:])} {moves} like {one.label}."
    left = found[len(shown):]
    if left:
        said += (f" Not shown: {listed([label for one in left for label in one.labels])}; the "
                 f"replay here shows at most {in_words(MOST)} motions.")
    return said
