"""The study of ticks among many obstacles: its scenes, its rows."""

import numpy as np
import pytest

from benchmark.studies import crowded
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.simulation import simulate


@pytest.fixture(scope="module")
def path():
    return simulate(load("ellipse-hqp", ["control.duration=0.2"]))


@pytest.mark.parametrize(("points", "obstacles"), [(8, 3), (5, 20)])
def test_a_crowded_scene_has_a_row_for_every_pair_and_no_obstacle_on_the_way(
        path, points, obstacles):
    ticks = crowded.Ticks(points, obstacles, path)
    cell = ticks.controller.cell
    assert len(cell.robot.control_points) == points
    assert cell.stack["separation"].dimension == (points + 1) * obstacles
    nearest = np.inf
    for k in range(0, len(path["t"]), 50):
        ticks.controller.command(path["t"][k], path["q"][k], path["v"][k])
        nearest = min(nearest, cell.sensor.measurement.distance.min())
    assert nearest >= 0.06
    ticks.take_turn()
    assert ticks.failures == 0
    rows = ticks.rows()
    assert [row["entrant"] for row in rows] == list(crowded.PARTS)
    assert rows[0]["rows"] == ticks.controller.hierarchy.m == 7 + (points + 1) * obstacles + 4


def test_the_letters_points_are_among_those_of_a_crowded_scene(path):
    """With eight points their spacing differs, but they lie on the same two links."""
    points = build(crowded.crowded(8, 3, path)).robot.control_points
    assert [point.joint for point in points] == [2, 2, 2, 2, 4, 4, 4, 4]
    assert points[3].offset.tolist() == [0.0, 0.4, 0.0]
    assert points[7].offset.tolist() == [0.0, -0.39, 0.0]
