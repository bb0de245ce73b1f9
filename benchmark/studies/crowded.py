"""A whole tick of `ellipse-hqp` over points and obstacles: python -m benchmark.studies.crowded.

`hcod` has a row for every pair of a control point and an obstacle. Growth of a solve over tasks,
rows and joints: `hierarchy bench growth --larger`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import typer

from benchmark import figures
from benchmark.report import Report, Section
from benchmark.solve.growth import over
from benchmark.store import Row
from benchmark.tick import of_ticks, runs_in_turns
from scenarios.config import Scenario, load
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate

PAIRS = ((8, 3), (8, 8), (16, 8), (16, 16), (32, 16), (32, 32), (64, 32), (64, 64), (64, 128),
         (64, 256))          # (control points, obstacles)
PARTS = ("kinematics", "sensing and rows", "resolve", "whole tick")
_ROOM = (0.7, 0.06)          # [m] half width of the box of obstacles; least distance to the path


def crowded(points: int, obstacles: int, path: Any, seed: int = 0) -> Scenario:
    """Return `ellipse-hqp` with so many control points on the two links, and random obstacles.

    Obstacles are points in a box about the arm, 6 cm or more from every control point along `path`.
    """
    half = (points + 1) // 2
    along = [*(("joint_2", [0.0, 0.4 * (i + 1) / half, 0.0]) for i in range(half)),
             *(("joint_4", [0.0, -0.39 * (i + 1) / (points - half), 0.0])
               for i in range(points - half))]
    placed = {"robot.control_points": [{"joint": joint, "offset": at} for joint, at in along]}
    controller, seen = Controller(load("ellipse-hqp", placed)), []
    for k in range(0, len(path["t"]), 50):
        controller.command(path["t"][k], path["q"][k], path["v"][k])
        seen.append(controller.cell.state.measurement.points.copy())  # type: ignore[union-attr]
    visited = np.concatenate(seen)
    rng, found = np.random.default_rng(seed), np.empty((0, 3))
    while len(found) < obstacles:  # ends: nearly all of the box is free
        some = rng.uniform(-_ROOM[0], _ROOM[0], (obstacles, 3))
        gap = np.array([np.linalg.norm(visited - centre, axis=1).min() for centre in some])
        found = np.concatenate([found, some[gap >= _ROOM[1]]])
    return load("ellipse-hqp", {**placed, "avoidance.obstacles": [
        {"centre": centre.tolist()} for centre in found[:obstacles]]})


def run(rounds: int = 3, pairs: Sequence[tuple[int, int]] = PAIRS, ticks: int = 1500) -> Report:
    """Time the tick at every number of points and obstacles, in runs that take turns.

    ticks : of each run.
    """
    duration = {"control.duration": 1e-3 * ticks}
    path = simulate(load("ellipse-hqp", duration))
    scenarios = {f"{points} {obstacles}": crowded(points, obstacles, path).with_changes(duration)
                 for points, obstacles in pairs}
    rows: list[Row] = []
    for label, times in runs_in_turns(scenarios, rounds).items():
        points, obstacles = map(int, label.split())
        kinematics, writing, resolve, _, _ = times.T
        parts = (kinematics, writing, resolve, kinematics + writing + resolve)
        rows += [{"figure": "pairs", "entrant": part, "points": points, "obstacles": obstacles,
                  "pairs": (points + 1) * obstacles, **of_ticks(some)}  # the last is the hand
                 for part, some in zip(PARTS, parts, strict=True)]
    panels = {"pairs": ("pairs $p$ of a point and an obstacle", "p", "a tick, 7 joints, hcod")}
    return Report("Ticks among many obstacles", [Section("", [
        over("Median time [us] over the number of pairs", rows, "pairs")],
        figures={"crowded": figures.over_sizes(rows, panels)})], {"crowded": rows})


def main(rounds: int = 3) -> None:
    """Print the table; rounds : runs of each."""
    run(rounds).say()


if __name__ == "__main__":
    typer.run(main)
