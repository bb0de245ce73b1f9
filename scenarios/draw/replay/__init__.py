"""The replay as one HTML document: scenes as plain numbers and base64, template, style, script."""

import base64
import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from hierarchy.errors import refuse
from scenarios.config import Scenario
from scenarios.draw.figures.palette import Look, looks
from scenarios.measure.happenings import Happening, happened
from scenarios.measure.verdict import verdict
from scenarios.recording.fate import PHRASES, Fate
from scenarios.recording.recording import Recording
from scenarios.scene.drawn import Scene, scene
from scenarios.scene.pushes import key
from scenarios.templates import render, resource

__all__ = ["html"]

NOTHING = 65535  # NaN or infinite
_STEPS = 65534


def packed(values: NDArray[Any], steps: bool = False) -> dict[str, Any]:
    """Return an array as shape, kind and base64, as the page reads it.

    Integers become int16 or, if they are small, int8; others float32 or, with `steps`, 65535 even
    steps from the smallest to the largest value.
    """
    about: dict[str, Any] = {"shape": list(values.shape)}
    if steps:
        known = np.isfinite(values)
        low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
        step = float(high - low) / _STEPS or 1.0
        values = np.where(known, np.round((np.where(known, values, low) - low) / step), NOTHING)
        kind, about = "<u2", about | {"low": float(low), "step": step}
    else:
        large = np.abs(values).max(initial=0) > np.iinfo(np.int8).max
        kind = "<f4" if values.dtype.kind == "f" else "<i2" if large else "|i1"
    data = np.ascontiguousarray(values.astype(kind)).tobytes()
    return {**about, "kind": kind[1:], "data": base64.b64encode(data).decode("ascii")}


def run_data(scene: Scene, scenario: Scenario, label: str, look: Look, **more: Any
             ) -> dict[str, Any]:
    """Return one run as the page's script reads it, with what `more` there is to say."""
    levels, frames = scene.levels, np.arange(len(scene.t))
    still = bool((scene.centres == scene.centres[:1]).all())
    places = {"links": scene.links, "points": scene.points, "axis": scene.axis,
              "nearest": scene.nearest[frames, scene.linked],
              "centres": scene.centres[:1] if still else scene.centres}
    if scene.desired is not None:
        places["desired"] = scene.desired
    if scene.pushes is not None:
        places |= scene.pushes._asdict()
    others: dict[str, NDArray[Any]] = {
        "t": scene.t, "linked": scene.linked, "active": scene.active, "order": scene.order,
        "distance": scene.distance[frames, scene.linked], "fate": levels.fate,
        "violation": levels.violation, "saturated": levels.saturated}
    return {"label": label, **look._asdict(), "scenario": scenario.name, "title": scenario.title,
            "level": scenario.control.level,
            "limited": getattr(scenario, "limits", None) is not None, **more,
            "radii": [capsule.radius for capsule in scene.robot.capsules],
            "obstacles": [{"shape": obstacle.shape, "size": list(obstacle.size),
                           "rotation": np.asarray(obstacle.rotation, float).ravel().tolist()}
                          for obstacle in scene.obstacles.obstacles],
            "areas": scene.areas, "floor": scene.robot.floor, "azimuth": scene.azimuth,
            "halfAngle": scene.half_angle,
            "wanted": None if scene.cone is None else scene.cone.tolist(),
            "orders": scene.orders, "tasks": levels.names, "units": levels.units,
            "joints": scene.robot.velocity_names,
            "paths": [{"task": path.task, "actual": packed(path.actual, steps=True),
                       "wanted": None if path.wanted is None else packed(path.wanted, steps=True)}
                      for path in scene.paths],
            "switches": packed(scene.switches),
            **{name: packed(values, steps=True) for name, values in places.items()},
            **{name: packed(values) for name, values in others.items()},
            "series": [{"name": one.name, "unit": one.unit, "labels": one.labels,
                        "marks": one.marks, "logarithmic": one.logarithmic,
                        **{side: packed(getattr(one, side)) for side in ("value", "low", "high")}}
                       for one in scene.series]}


_FOLDER = "draw/replay"
_SCRIPTS = ("data.js", "space.js", "painter.js", "sketch.js", "stage.js", "curves.js",
            "stack.js", "player.js")


def html(recordings: Mapping[str, Recording], title: str,
         happenings: Mapping[str, Iterable[Happening]] | None = None, *, rate: float = 30.0,
         embedded: bool = False, beside: bool = False) -> str:
    """Return a replay of runs, by label, as a self-contained document.

    `happenings` are those of each run, where they are known; `rate` is in frames per second. With
    `embedded` the document has no heading, is as tall as its content, and leaves the mouse wheel to
    the surrounding page. With `beside` several runs are side by side at first. Raises
    HierarchyError if there is nothing to show.
    """
    refuse(not recordings, "a replay needs at least one run")
    look = looks(recordings)
    runs = [run_data(
        scene(recording, rate), recording.scenario, label, look[label], fault=recording.fault,
        events=[{"t": one.t, "text": f"{one.what}: {one.why}"} for one in (
            happenings[label] if happenings else happened(recording))],
        **verdict(recording).on_page()) for label, recording in recordings.items()]
    drawn = {name: words for one in recordings.values()
             for name, words in key(one.facts, one.scenario).items()}
    return document(title, {"runs": runs, "embedded": embedded, "beside": beside, "drawn": drawn},
                    "embedded" if embedded else "whole")


def document(title: str, data: Mapping[str, Any], kind: str, more: str = "",
             player: str = "Player") -> str:
    """Return the page of a `kind` that its `player` plays; `more` is a script that it needs."""
    from scenarios.draw.figures.drawing import JOINTS

    known = {**data, "joints": JOINTS,
             "fates": {fate.name.lower(): int(fate) for fate in Fate},
             "phrases": {fate.name.lower(): said for fate, said in PHRASES.items()}}
    return str(render(  # not markup: a page that embeds it has to escape it
        f"{_FOLDER}/replay.html", title=title, style=resource(f"{_FOLDER}/replay.css"),
        script=Markup("\n").join([*(resource(f"{_FOLDER}/{name}") for name in _SCRIPTS),
                                  Markup(more)]),
        kind=kind, player=player, data=Markup(as_json(known).replace("<", "\\u003c"))))


def as_json(data: Any) -> str:
    """Return plain data as compact JSON."""
    return json.dumps(data, separators=(",", ":"), allow_nan=False)
