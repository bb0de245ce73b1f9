"""Ticks of `ellipse`, compiled and plain, and among many obstacles."""

import numpy as np
import pytest

from benchmark import tick
from benchmark.plain import PlainTick
from benchmark.studies import crowded
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate


@pytest.mark.slow
def test_the_plain_numpy_tick_commands_what_the_compiled_one_does():
    """Else the benchmark would compare two different jobs."""
    scenario = load("ellipse")
    plain, path = PlainTick(scenario, build(scenario)), simulate(scenario)
    for k in range(0, path.ticks, 100):
        found = plain.step(path["t"][k], path["q"][k], path["v"][k])
        np.testing.assert_allclose(found, path["a"][k], atol=1e-8)


@pytest.mark.slow
def test_the_tick_benchmark_has_a_row_for_every_candidate(monkeypatch):
    monkeypatch.setattr(tick, "_ROUNDS", 2)
    rows = tick.run(load("ellipse", ["control.duration=0.6"])).rows["tick"]
    assert [row["tick"] for row in rows] == [*tick.SPECS, "plain numpy"]
    assert all(row["failures"] == 0 for row in rows)
    assert [row["ticks"] for row in rows] == [2 * (600 - tick.LEAD_IN)] * 4 + [600 - tick.LEAD_IN]
    assert all(row["median_us"] <= row["p95_us"] for row in rows)


@pytest.fixture(scope="module")
def path():
    return simulate(load("ellipse-hqp", ["control.duration=0.2"]))


@pytest.mark.parametrize(("points", "obstacles"), [(8, 3), (5, 20)])
def test_a_crowded_scene_has_a_row_for_every_pair_and_no_obstacle_on_the_way(
        path, points, obstacles):
    controller = Controller(crowded.crowded(points, obstacles, path))
    cell, nearest = controller.cell, np.inf
    assert len(cell.robot.control_points) == points
    assert cell.stack["separation"].dimension == (points + 1) * obstacles
    for k in range(0, len(path["t"]), 50):
        controller.command(path["t"][k], path["q"][k], path["v"][k])
        nearest = min(nearest, cell.sensor.measurement.distance.min())
    assert nearest >= 0.06
    assert controller.hierarchy.m == 7 + (points + 1) * obstacles + 4


def test_ticks_among_obstacles_are_timed_by_parts():
    rows = crowded.run(1, [(8, 3), (8, 8)], 100).rows["crowded"]
    assert [row["entrant"] for row in rows] == [*crowded.PARTS] * 2
    assert all(row["failures"] == 0 and row["median_us"] > 0.0 for row in rows)


def test_the_letters_points_are_among_those_of_a_crowded_scene(path):
    """With eight points their spacing differs, but they lie on the same two links."""
    points = build(crowded.crowded(8, 3, path)).robot.control_points
    assert [point.joint for point in points] == [2, 2, 2, 2, 4, 4, 4, 4]
    assert points[3].offset.tolist() == [0.0, 0.4, 0.0]
    assert points[7].offset.tolist() == [0.0, -0.39, 0.0]
