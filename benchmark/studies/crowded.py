"""A whole tick of `ellipse-hqp` over points and obstacles: python -m benchmark.studies.crowded.

`hcod` has a row for every pair of a control point and an obstacle. Growth of a solve over tasks,
rows and joints: `hierarchy bench growth --larger`.
"""

from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter
from typing import Any

import numpy as np
import typer

from benchmark import figures
from benchmark.machine import one_core
from benchmark.report import Report, Section
from benchmark.solve.growth import over
from benchmark.store import Row
from benchmark.timing import times_of
from scenarios.config import Scenario, load
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate
from solvers import Status

PAIRS = ((8, 3), (8, 8), (16, 8), (16, 16), (32, 16), (32, 32), (64, 32), (64, 64), (64, 128),
         (64, 256))          # (control points, obstacles)
PARTS = ("kinematics", "sensing and rows", "resolve", "whole tick")
_BLOCK = 25                  # ticks of one candidate in its turn
_ROOM = (0.7, 0.06)          # [m] half width of the box of obstacles; least distance to the path


class Ticks:
    """The tick of `ellipse-hqp` with other points and obstacles, along the states of its run."""

    def __init__(self, points: int, obstacles: int, path: Any) -> None:
        self.points, self.obstacles, self.path = points, obstacles, path
        self.times, self.failures, self.at = list[list[float]](), 0, 0
        self.controller = Controller(crowded(points, obstacles, path))

    def take_turn(self) -> None:
        """Go a block of ticks further along the run; the first, whose caches are cold, not timed.

        What the solver remembers is that of the tick before, as in the loop.
        """
        t, q, v = self.path["t"], self.path["q"], self.path["v"]
        for k in range(_BLOCK):
            i = (self.at + k) % len(t)
            self.controller.command(t[i], q[i], v[i])
            begin, moved, written, resolved = self.controller.stamps
            if k > 0 and i > 0:
                self.times.append([moved - begin, written - moved, resolved - written,
                                   resolved - begin])
                self.failures += self.controller.resolution.status is not Status.SOLVED
        self.at = (self.at + _BLOCK) % len(t)

    def rows(self) -> list[Row]:
        """Return a row for each part of the tick."""
        pairs = (self.points + 1) * self.obstacles  # the end effector is the last point
        return [{"figure": "pairs", "entrant": part, "rows": self.controller.hierarchy.m,
                 "points": self.points, "obstacles": self.obstacles, "pairs": pairs,
                 "failures": self.failures, **times_of(1e9 * times)}
                for part, times in zip(PARTS, np.array(self.times).T, strict=True)]


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


def run(seconds: float = 30.0, pairs: Sequence[tuple[int, int]] = PAIRS, ticks: int = 1500
        ) -> Report:
    """Time the tick at every number of points and obstacles, by turns, for `seconds` [s].

    ticks : of the run whose states are used.
    """
    path = simulate(load("ellipse-hqp", [f"control.duration={1e-3 * ticks!r}"]))
    everyone = [Ticks(points, obstacles, path) for points, obstacles in pairs]
    with one_core():
        for one in everyone:
            one.take_turn()
            one.times.clear()
        end = perf_counter() + seconds
        while perf_counter() < end or not everyone[-1].times:
            for one in everyone:
                one.take_turn()
    rows = [row for one in everyone for row in one.rows()]
    panels = {"pairs": ("pairs $p$ of a point and an obstacle", "p", "a tick, 7 joints, hcod")}
    return Report("Ticks among many obstacles", [Section("", [
        over("Median time [us] over the number of pairs", rows, "pairs")],
        figures={"crowded": figures.over_sizes(rows, panels)})], {"crowded": rows})


def main(seconds: float = 30.0) -> None:
    """Print the table; seconds : for all times together."""
    run(seconds).say()


if __name__ == "__main__":
    typer.run(main)
