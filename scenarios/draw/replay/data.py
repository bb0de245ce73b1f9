"""Scenes as data of a replay: plain numbers, and arrays in base64."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenarios.recording.fate import PHRASES, Fate
from scenarios.scene import Scene, Series

NOTHING = 65535  # NaN or infinite
_STEPS = 65534


def packed(values: NDArray[Any], steps: bool = False) -> dict[str, Any]:
    """Return an array as shape, kind and base64, as the page reads it.

    Integers become int16 or, if they are small, int8; others float32 or, with `steps`, 65535 even
    steps from the smallest to the largest value.
    """
    if steps:
        return _in_steps(values)
    large = np.abs(values).max(initial=0) > np.iinfo(np.int8).max
    kind = "<f4" if values.dtype.kind == "f" else "<i2" if large else "|i1"
    return {"shape": list(values.shape), "kind": kind[1:], "data": _base64(values.astype(kind))}


def _in_steps(values: NDArray[Any]) -> dict[str, Any]:
    known = np.isfinite(values)
    low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
    step = float(high - low) / _STEPS or 1.0
    at = np.where(known, np.round((np.where(known, values, low) - low) / step), NOTHING)
    return {"shape": list(values.shape), "kind": "u2", "low": float(low), "step": step,
            "data": _base64(at.astype("<u2"))}


def run_data(scene: Scene, about: dict[str, Any]) -> dict[str, Any]:
    """Return one run as the page's script reads it; `about` is added unchanged."""
    fixed, levels, frames = scene.stage, scene.levels, np.arange(len(scene.t))
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
    return {**about,
            "radii": [capsule.radius for capsule in fixed.capsules],
            "obstacles": [{"shape": obstacle.shape, "size": list(obstacle.size),
                           "rotation": np.asarray(obstacle.rotation, float).ravel().tolist()}
                          for obstacle in fixed.obstacles.obstacles],
            "areas": fixed.areas, "floor": fixed.floor, "azimuth": fixed.azimuth,
            "halfAngle": fixed.half_angle,
            "wanted": None if fixed.axis is None else fixed.axis.tolist(),
            "orders": scene.orders, "tasks": levels.names, "units": levels.units,
            "paths": [{"task": path.task, "actual": packed(path.actual, steps=True),
                       "wanted": None if path.wanted is None else packed(path.wanted, steps=True)}
                      for path in scene.paths],
            "switches": packed(scene.switches),
            **{name: packed(values, steps=True) for name, values in places.items()},
            **{name: packed(values) for name, values in others.items()},
            "series": [_curve(series) for series in scene.series]}


def fates() -> dict[str, int]:
    """Return the values of `Fate` by name, for the page's script."""
    return {fate.name.lower(): int(fate) for fate in Fate}


def phrases() -> dict[str, str]:
    """Return the words for each `Fate` by name, for the page's script."""
    return {fate.name.lower(): said for fate, said in PHRASES.items()}


def _curve(series: Series) -> dict[str, Any]:
    return {"name": series.name, "unit": series.unit, "labels": series.labels,
            "marks": series.marks, "logarithmic": series.logarithmic,
            **{side: packed(getattr(series, side)) for side in ("value", "low", "high")}}


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
