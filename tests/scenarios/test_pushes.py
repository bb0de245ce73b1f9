"""What is drawn of contacts: forces, friction cones and the support polygon."""

import json
import re

import numpy as np
import pytest
from packing import unpacked

from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.draw.replay.page import html
from scenarios.draw.viewer.moment import Watched, of_scene
from scenarios.loop.controller import Controller
from scenarios.loop.facts import ContactPoint
from scenarios.loop.recording import load_run, write
from scenarios.scene import scene
from scenarios.scene.pushes import pushes


def still(*points):
    """Placements (1, 1, 12) of a base at the origin, and points there."""
    row = np.concatenate([np.eye(3).ravel(), np.zeros(3)])
    return row[None, None], [ContactPoint("sole", 0, tuple(map(float, p)), (0.0, 0.0, 1.0), 0.5)
                             for p in points]


def test_an_arrow_is_2_mm_for_each_newton_and_a_cone_as_wide_as_its_friction():
    placements, points = still((0.1, 0.0, 0.0))
    found = pushes(points, placements, np.array([[[10.0, 0.0, 50.0]]])).at(0)
    np.testing.assert_allclose(found.force, [[[0.1, 0.0, 0.0], [0.12, 0.0, 0.1]]])
    rim = found.cone[:, 1] - [0.1, 0.0, 0.0]
    np.testing.assert_allclose(np.linalg.norm(rim[:, :2], axis=1) / rim[:, 2], 0.5)
    assert len(found.support) == 0  # one point spans nothing


def test_the_support_is_the_hull_of_the_points_that_carry_something():
    corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0),
               (0.4, 0.5, 0.0), (5.0, 5.0, 0.0)]
    placements, points = still(*corners)
    forces = np.tile([0.0, 0.0, 10.0], (1, 6, 1))
    forces[0, 5] = 0.0
    found = pushes(points, placements, forces).at(0)
    assert sorted(map(tuple, found.support[:, 0])) == sorted(corners[:4])
    np.testing.assert_array_equal(found.support[:, 1], np.roll(found.support[:, 0], -1, axis=0))
    assert len(found.force) == 6
    forces[0, 0] = np.nan
    assert len(pushes(points, placements, forces).at(0).force) == 5


@pytest.fixture(scope="module")
def run():
    pytest.importorskip("mujoco")
    return simulate(load("stand-push").with_changes({"control.duration": 0.02}))


def test_replay_and_kept_runs_have_them(run, tmp_path):
    write(run, tmp_path)
    again = load_run(tmp_path)
    assert again.facts.contacts == run.facts.contacts
    drawn = scene(again).pushes
    assert drawn.force.shape[1:] == (8, 2, 3)
    np.testing.assert_allclose(drawn.force[0, :, 0, 2], 0.0, atol=1e-9)  # soles on the floor
    sole = drawn.support[0][np.isfinite(drawn.support[0]).all(axis=(1, 2))]
    assert np.ptp(sole[..., 0]) == pytest.approx(0.21)
    data = re.search(r'id="data">(.*?)</script>', html({"a": run}, "title"), re.DOTALL)
    first = json.loads(data[1])["runs"][0]
    np.testing.assert_allclose(unpacked(first["force"]), drawn.force, atol=1e-4)


def test_the_viewers_show_the_same_live_and_afterwards(run):
    watched = Watched(Controller(run.scenario, build(run.scenario)))
    controller = watched.controller
    assert watched.moment().pushes is None
    plant = controller.cell.plant
    controller.command(0.0, plant.q, plant.v)
    live, kept = watched.moment().pushes, of_scene(scene(run), 0).pushes
    for one, other in zip(live, kept, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-9)
