"""The camera image of a run from when the end effector was nearest to an obstacle."""

from __future__ import annotations

import numpy as np

from scenarios.cell.build import build
from scenarios.cell.sensors import DepthSensor
from scenarios.config.plant import KinematicSection
from scenarios.loop.depth_view import DepthView
from scenarios.loop.recording import Recording


def depth_view(recording: Recording, t: float | None = None) -> DepthView | None:
    """Take the image of a run's camera at time t [s]; None without a camera or before its first.

    The default is the tick in which the end effector is nearest to an obstacle, or the last tick if
    no obstacle was seen. The camera is built from the scenario, with zero latency.
    """
    if recording.scenario.sensor.kind != "camera" or not recording.ticks:
        return None
    k = _nearest(recording) if t is None else int(np.argmin(np.abs(recording["t"] - t)))
    sensor = recording.scenario.sensor.model_copy(update={"latency": 0.0})
    at_rest = {"sensor": sensor, "plant": KinematicSection()}
    cell = build(recording.scenario.model_copy(update=at_rest))
    moved = cell.state.move(float(recording["t"][k]), recording["q"][k], recording["v"][k])
    if not moved or not isinstance(cell.sensor, DepthSensor):
        return None
    seen, image = cell.sensor.measure(cell.state), cell.sensor.reading
    return None if image is None else DepthView(
        cell.state.t, image.copy(), cell.sensor.space.pinhole.packed(), seen.points.copy(),
        seen.distance.copy(), seen.nearest.copy(), seen.active)


def _nearest(recording: Recording) -> int:
    distance = np.where(np.isnan(recording["ee_distance"]), np.inf, recording["ee_distance"])
    return int(np.argmin(distance)) if np.isfinite(distance).any() else recording.ticks - 1
