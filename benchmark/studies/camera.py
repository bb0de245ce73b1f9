"""Time of a depth camera's parts at 640 x 480, one core: `python -m benchmark.studies.camera`."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np

from benchmark.machine import one_core
from benchmark.report import Report, Section
from benchmark.tables import Column, Table, text
from hierarchy.problem import Array
from scenarios.cell.build import Cell, build
from scenarios.cell.sensors import DepthSensor
from scenarios.cell.sensors.camera import DepthCamera
from scenarios.cell.sensors.pixels import ObstacleImage
from scenarios.config import Scenario, load

_WARM_UP, _TIMES = 20, 300
_TURN = 0.3  # [rad] by which joints are moved between two calls

# The arm of `human` and a hand near it; a wall close behind the arm; a curtain before it, in whose
# shadow all points are, so that every pixel they may see is in their region.
_WALL = "[{{shape='box', centre=[0.0, {}, 0.1], half_lengths=[2.0, 0.02, 2.0]}}]"
SCENES = {"hand": "[{shape='capsule', centre=[0.45, 0.62, 0.05], radius=0.045, half_length=0.12, "
                  "rotation=[[0,0,1],[0,1,0],[-1,0,0]]}]",
          "wall": _WALL.format(-0.15), "curtain": _WALL.format(1.0)}


def run() -> Report:
    """Time drawing, errors, obstacle image and distances of nine points in each scene.

    The arm is somewhere else in each call. One row a part and scene, times in milliseconds.
    """
    with one_core():
        rows = [row for name, obstacles in SCENES.items()
                for row in _scene(name, load("human", ["plant={}", "sensor={kind='camera'}",
                                                       f"avoidance.obstacles={obstacles}"]))]
    shares = {row["scene"]: row["points that see something"] for row in rows}
    said = ", ".join(f"{scene} {share:.2f}" for scene, share in shares.items())
    title = "Depth camera of 640 x 480 pixels, milliseconds, one core, warm kernels"
    return Report(title, [Section("", [Table(title, rows, (
        Column("part", "part", text), Column("median", "median_ms"), Column("p95", "p95_ms"),
        Column("p99.9", "p99.9_ms"), Column("most", "most_ms")), "scene")],
        f"share of points with a distance: {said}")], {"camera": rows})


def _scene(name: str, scenario: Scenario) -> list[dict[str, Any]]:
    cell, ideal = build(scenario), build(_ideal(scenario))
    sensor, bare = cell.sensor, ideal.sensor
    assert isinstance(sensor, DepthSensor)
    assert isinstance(bare, DepthSensor)
    assert isinstance(sensor.source, DepthCamera)
    assert isinstance(bare.source, DepthCamera)
    image = ObstacleImage.empty(480, 640)
    reading = sensor.source.image(0, cell.state)[0]
    parts: dict[str, Callable[[], Any]] = {
        "draw": partial(bare.source.image, 0, cell.state),
        "draw, with errors": partial(sensor.source.image, 0, cell.state),
        "find obstacles": lambda: sensor.space.find_obstacles(reading, cell.state.placements,
                                                              image),
        "distances of 9 points": lambda: sensor.space.measure(image, cell.state.placements)}
    times = {part: _time(cell, call, parts) for part, call in parts.items()}
    seen = float(np.isfinite(sensor.measurement.distance).mean())
    return [{"scene": name, "part": part, **_row(samples), "points that see something": seen}
            for part, samples in times.items()]


def _ideal(scenario: Scenario) -> Scenario:
    return scenario.model_copy(update={
        "sensor": scenario.sensor.model_copy(update={"ideal": True})})


def _time(cell: Cell, call: Callable[[], Any], parts: dict[str, Callable[[], Any]]) -> Array:
    rng, q = np.random.default_rng(0), cell.plant.q.copy()
    samples = np.empty(_TIMES)
    for k in range(-_WARM_UP, _TIMES):
        cell.state.move(0.0, q + rng.uniform(-_TURN, _TURN, q.shape), np.zeros(cell.robot.n))
        for part in ("draw, with errors", "find obstacles"):  # what the others work on
            parts[part]()
        begin = perf_counter()
        call()
        if k >= 0:
            samples[k] = perf_counter() - begin
    return samples * 1e3


def _row(samples: Array) -> dict[str, float]:
    median, p95, p999 = np.percentile(samples, [50, 95, 99.9])
    return {"median_ms": median, "p95_ms": p95, "p99.9_ms": p999, "most_ms": samples.max()}


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    run().say()
