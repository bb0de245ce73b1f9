"""The replay as one HTML document: template, style, script and data."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from hierarchy.errors import HierarchyError
from scenarios.draw.figures.palette import looks
from scenarios.draw.replay.data import fates, phrases, run_data
from scenarios.measure.jumps import Happening, happened
from scenarios.measure.verdict import verdict
from scenarios.scene import scene
from scenarios.scene.pushes import key
from scenarios.templates import render, resource

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording

_FOLDER = "draw/replay"
_SCRIPTS = ("data.js", "space.js", "painter.js", "sketch.js", "stage.js", "curves.js",
            "stack.js", "player.js")


def html(recordings: Mapping[str, Recording], title: str,
         happenings: Mapping[str, Iterable[Happening]] | None = None, *, rate: float = 30.0,
         embedded: bool = False) -> str:
    """Return a replay of runs, by label, as a self-contained document.

    `happenings` are those of each run, where they are known; `rate` is in frames per second. With
    `embedded` the document has no heading, is as tall as its content, and leaves the mouse wheel to
    the surrounding page. Raises HierarchyError if there is nothing to show.
    """
    from scenarios.draw.figures.drawing import JOINTS

    if not recordings:
        raise HierarchyError("a replay needs at least one run")
    look = looks(recordings)
    runs = [run_data(scene(recording, rate), {"label": label, **look[label]._asdict(),
                                              **_about(recording, happenings[label] if happenings
                                                       else happened(recording))})
            for label, recording in recordings.items()]
    data = {"runs": runs, "fates": fates(), "phrases": phrases(), "joints": JOINTS,
            "embedded": embedded,
            "drawn": {name: words for one in recordings.values()
                      for name, words in key(one.facts, one.scenario).items()}}
    document = render(
        f"{_FOLDER}/replay.html", title=title, style=resource(f"{_FOLDER}/replay.css"),
        script=Markup("\n").join(resource(f"{_FOLDER}/{name}") for name in _SCRIPTS),
        kind="embedded" if embedded else "whole",
        data=Markup(json.dumps(data, separators=(",", ":"), allow_nan=False).replace(
            "<", "\\u003c")))
    return str(document)  # not markup: a page that embeds it has to escape it


def _about(recording: Recording, happenings: Iterable[Happening]) -> dict[str, Any]:
    scenario = recording.scenario
    limits = getattr(scenario, "limits", None)
    return {"scenario": scenario.name, "title": scenario.title, "fault": recording.fault,
            "goals": list(verdict(recording).said), "level": scenario.control.level,
            "limited": limits is not None,
            "events": [{"t": one.t, "text": f"{one.what}: {one.why}"} for one in happenings]}
