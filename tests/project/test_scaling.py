"""The benchmark of sizes: its stacks, its crowded scenes, its files."""

import csv

import numpy as np
import pytest
import scaling
import scaling_figure
import scaling_timed

from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.simulation import simulate


@pytest.fixture(scope="module")
def path():
    return simulate(load("ellipse-hqp", ["control.duration=0.2"]))


def test_random_stacks_have_the_size_that_was_asked_for():
    h = scaling_timed.random_hierarchy((12, 4, 2), seed=1)
    assert (h.n, h.sizes.tolist()) == (12, [2, 2, 2, 2])
    assert np.linalg.matrix_rank(h.A) == 8


@pytest.mark.parametrize(("points", "obstacles"), [(8, 3), (5, 20)])
def test_a_crowded_scene_has_a_row_for_every_pair_and_no_obstacle_on_the_way(
        path, points, obstacles):
    ticks = scaling_timed.Ticks(points, obstacles, path)
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
    assert [row["resolver"] for row in rows] == list(scaling_timed.PARTS)
    assert rows[0]["rows"] == ticks.controller.hierarchy.m == 7 + (points + 1) * obstacles + 4


def test_the_letters_points_are_among_those_of_a_crowded_scene(path):
    """With eight points their spacing differs, but they lie on the same two links."""
    points = build(scaling_timed.crowded(8, 3, path)).robot.control_points
    assert [point.joint for point in points] == [2, 2, 2, 2, 4, 4, 4, 4]
    assert points[3].offset.tolist() == [0.0, 0.4, 0.0]
    assert points[7].offset.tolist() == [0.0, -0.39, 0.0]


@pytest.mark.slow
def test_a_small_run_writes_every_size_and_a_figure(tmp_path, monkeypatch):
    monkeypatch.setattr(scaling, "_TICKS", 60)
    sizes = {"tasks": ((9, 1, 2), (9, 3, 2)), "rows": ((9, 2, 1), (9, 2, 3)),
             "joints": ((6, 2, 2), (12, 2, 2))}
    rows = scaling.run(tmp_path, seconds=0.0, sizes=sizes, pairs=((3, 2), (4, 4)))
    assert {row["figure"] for row in rows} == {"tasks", "rows", "joints", "pairs"}
    assert all(row["median_us"] > 0.0 for row in rows)
    assert sorted({row["rows"] for row in rows if row["figure"] == "rows"}) == [2, 6]
    assert {path.name for path in tmp_path.iterdir()} == {"scaling.csv", "scaling.png",
                                                          "scaling.svg", "machine.json"}
    with (tmp_path / "scaling.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(rows)


def test_the_figure_has_a_panel_for_what_was_timed():
    rows = [{"figure": "rows", "resolver": label, "joints": 9, "tasks": 2, "rows": 2 * size,
             "median_us": time * size, "p95_us": 2.0 * time * size}
            for label, time in (("tpm", 1.0), ("hcod", 2.0)) for size in (1, 2, 4)]
    fig = scaling_figure.time_over_sizes(rows)
    shown = [ax.get_title(loc="left") for ax in fig.axes if ax.axison]
    assert shown == ["9 joints, 2 tasks"]
    assert scaling_figure.fixed("rows", rows) == shown[0]
