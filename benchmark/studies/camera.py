"""Time of a depth camera's parts at 640 x 480, one core: `python -m benchmark.studies.camera`."""

from __future__ import annotations

from time import perf_counter
from typing import Any

import numpy as np
import typer

from benchmark.machine import one_core
from benchmark.report import Report, Section
from benchmark.tables import TIMES, Column, Table, text
from benchmark.timing import times_of
from scenarios.cell.build import build
from scenarios.cell.sensors.pixels import ObstacleImage
from scenarios.config import load

_WARM_UP = 5
_TURN = 0.3  # [rad] by which joints are moved between two calls

# The arm of `human` and a hand near it; a wall close behind the arm; a curtain before it, in whose
# shadow all points are, so that every pixel they may see is in their region.
_WALL = "[{{shape='box', centre=[0.0, {}, 0.1], half_lengths=[2.0, 0.02, 2.0]}}]"
SCENES = {"hand": "[{shape='capsule', centre=[0.45, 0.62, 0.05], radius=0.045, half_length=0.12, "
                  "rotation=[[0,0,1],[0,1,0],[-1,0,0]]}]",
          "wall": _WALL.format(-0.15), "curtain": _WALL.format(1.0)}


def run(times: int = 100) -> Report:
    """Time drawing, errors, obstacle image and distances of nine points in each scene.

    The arm is somewhere else each time. One row a part and scene, times in microseconds.
    """
    rows, seen = [], []
    with one_core():
        for scene, obstacles in SCENES.items():
            found, share = _measured(["plant={}", "sensor={kind='camera'}",
                                      f"avoidance.obstacles={obstacles}"], times)
            rows += [{"scene": scene, "part": part, **times_of(1e9 * np.array(some))}
                     for part, some in found.items()]
            seen.append(f"{scene} {share:.2f}")
    title = "Depth camera of 640 x 480 pixels, microseconds, one core, warm kernels"
    return Report(title, [Section("", [Table(title, rows, (
        Column("part", "part", text), *TIMES, Column("most", "most_us")), "scene")],
        f"share of points with a distance: {', '.join(seen)}")], {"camera": rows})


def _measured(changes: list[str], times: int) -> tuple[dict[str, list[float]], float]:
    """Return the times [s] of each part, and the share of the points that see something."""
    cell, ideal = (build(load("human", [*changes, f"sensor.ideal={word}"]))
                   for word in ("false", "true"))
    sensor: Any = cell.sensor
    bare: Any = ideal.sensor
    state = cell.state
    image, q = ObstacleImage.empty(480, 640), cell.plant.q.copy()
    reading: Any = None
    rng, found = np.random.default_rng(0), dict[str, list[float]]()
    for k in range(-_WARM_UP, times):
        state.move(0.0, q + rng.uniform(-_TURN, _TURN, q.shape), np.zeros(cell.robot.n))
        stamps = [perf_counter()]
        bare.source.image(0, state)
        stamps.append(perf_counter())
        reading = sensor.source.image(0, state)[0]
        stamps.append(perf_counter())
        sensor.space.find_obstacles(reading, state.placements, image)
        stamps.append(perf_counter())
        sensor.space.measure(image, state.placements)
        stamps.append(perf_counter())
        for part, spent in zip(("draw", "draw, with errors", "find obstacles",
                                "distances of 9 points"), np.diff(stamps), strict=True):
            found.setdefault(part, []).extend([float(spent)] if k >= 0 else [])
    return found, float(np.isfinite(sensor.measurement.distance).mean())


def main(times: int = 100) -> None:
    """Print the table."""
    run(times).say()


if __name__ == "__main__":
    typer.run(main)
