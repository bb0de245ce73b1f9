"""What `scaling` times: solves of random hierarchies, and ticks among many points and obstacles."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, final

import numpy as np

from hierarchy.problem import Array, Hierarchy
from scenarios.bench.accuracy import entrants
from scenarios.bench.growth import LEVEL_LESS, Timed
from scenarios.config import Scenario, load
from scenarios.loop.controller import Controller
from solvers import Status

Size = tuple[int, int, int]  # joints, tasks, rows of each
PARTS = ("kinematics", "sensing and rows", "resolve", "whole tick")

_BLOCK = 25          # ticks of one candidate in its turn
_ROOM = (0.7, 0.06)  # [m] half width of the box of obstacles; least distance to the path


def random_hierarchy(size: Size, seed: int) -> Hierarchy:
    """Return random levels on so many joints: of full rank, where there are joints enough."""
    joints, tasks, rows = size
    rng = np.random.default_rng(seed)
    return Hierarchy.from_levels([(rng.normal(size=(rows, joints)), rng.normal(size=rows))
                                  for _ in range(tasks)])


@final
@dataclass
class Solve:
    """One resolver at one size of one figure."""

    figure: str
    timed: Timed
    size: Size

    def row(self) -> dict[str, Any]:
        """Return what is written down."""
        return {**self.timed.row(self.figure), "rows": self.size[1] * self.size[2]}


def solves_of(figure: str, sizes: Sequence[Size]) -> list[Solve]:
    """Return everyone that keeps priorities at every size of a figure."""
    solves = {label: solve for label, solve in entrants().items() if label not in LEVEL_LESS}
    return [Solve(figure, Timed(label, size[0], size[1], _call(solve, h)), size)
            for i, size in enumerate(sizes) for h in [random_hierarchy(size, i)]
            for label, solve in solves.items()]


def _call(solve: Callable[[Hierarchy], Any], h: Hierarchy) -> Callable[[], Any]:
    return lambda: solve(h)


# -- whole ticks over control points and obstacles -------------------------------------------------

@final
@dataclass
class Ticks:
    """The tick of `ellipse-hqp` with other points and obstacles, along the states of its run."""

    points: int
    obstacles: int
    path: Any
    times: list[list[float]] = field(default_factory=list)
    failures: int = 0
    most: int = 0
    at: int = 0

    def __post_init__(self) -> None:
        self.controller = Controller(crowded(self.points, self.obstacles, self.path))

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
                resolution = self.controller.resolution
                self.failures += resolution.status is not Status.SOLVED
                self.most = max(self.most, resolution.iterations)
        self.at = (self.at + _BLOCK) % len(t)

    def warm_up(self) -> None:
        """Take a turn that does not count."""
        self.take_turn()
        self.times.clear()
        self.failures = 0

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each part of the tick."""
        median, p95 = np.percentile(1e6 * np.array(self.times), [50, 95], axis=0)
        pairs = (self.points + 1) * self.obstacles  # the end effector is the last point
        return [{"figure": "pairs", "resolver": part, "joints": self.controller.cell.robot.n,
                 "tasks": len(self.controller.cell.stack), "rows": self.controller.hierarchy.m,
                 "points": self.points, "obstacles": self.obstacles, "pairs": pairs,
                 "solves": len(self.times), "failures": self.failures, "iterations": self.most,
                 "median_us": float(median[i]), "p95_us": float(p95[i])}
                for i, part in enumerate(PARTS)]


def crowded(points: int, obstacles: int, path: Any, seed: int = 0) -> Scenario:
    """Return `ellipse-hqp` with so many control points on the two links, and random obstacles.

    Obstacles are points in a box about the arm, 6 cm or more from every control point along `path`.
    """
    half = (points + 1) // 2
    along = [*(("joint_2", (0.0, 0.4 * (i + 1) / half, 0.0)) for i in range(half)),
             *(("joint_4", (0.0, -0.39 * (i + 1) / (points - half), 0.0))
               for i in range(points - half))]
    scenario = load("ellipse-hqp", {"robot.control_points": [
        {"joint": joint, "offset": list(offset)} for joint, offset in along]})
    visited = _visited(scenario, path)
    rng, found = np.random.default_rng(seed), np.empty((0, 3))
    while len(found) < obstacles:  # ends: nearly all of the box is free
        some = rng.uniform(-_ROOM[0], _ROOM[0], (obstacles, 3))
        gap = np.array([np.linalg.norm(visited - centre, axis=1).min() for centre in some])
        found = np.concatenate([found, some[gap >= _ROOM[1]]])
    return load("ellipse-hqp", {
        "robot.control_points": [{"joint": joint, "offset": list(offset)}
                                 for joint, offset in along],
        "avoidance.obstacles": [{"centre": centre.tolist()} for centre in found[:obstacles]]})


def _visited(scenario: Scenario, path: Any) -> Array:
    """Where the control points and the end effector are along the path: (N, 3) [m]."""
    controller = Controller(scenario)
    seen = []
    for k in range(0, len(path["t"]), 50):
        controller.command(path["t"][k], path["q"][k], path["v"][k])
        seen.append(controller.cell.state.measurement.points.copy())  # type: ignore[union-attr]
    return np.concatenate(seen)
