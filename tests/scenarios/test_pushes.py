"""What is drawn of contacts: forces, friction cones, support polygon, pushes."""

from dataclasses import replace

import numpy as np
import pytest

from hierarchy import Robot
from scenarios import load, simulate
from scenarios.draw.replay.page import html
from scenarios.draw.viewer.live import Live
from scenarios.recording.facts import ContactPoint, facts_of
from scenarios.scene import scene
from scenarios.scene.pushes import pushes

STANDING, STEP = load("stand-push"), load("step")
FACTS = facts_of(STANDING, Robot.named("humanoid"))
ORIGIN = np.concatenate([np.eye(3).ravel(), np.zeros(3)])


def drawn(contacts, forces, com=None):
    """What is drawn of points of contacts, by name, of a base at the origin."""
    points = tuple(ContactPoint(name, 0, tuple(map(float, p)), (0.0, 0.0, 1.0), 0.5)
                   for name, of in contacts.items() for p in of)
    return pushes(replace(FACTS, contacts=points), STEP, np.zeros(1), ORIGIN[None, None],
                  np.asarray(forces, dtype=float), com).at(0)


def test_an_arrow_is_2_mm_for_each_newton_and_a_cone_as_wide_as_its_friction():
    found = drawn({"sole": [(0.1, 0.0, 0.0)]}, [[[10.0, 0.0, 50.0]]])
    np.testing.assert_allclose(found.force, [[[0.1, 0.0, 0.0], [0.12, 0.0, 0.1]]])
    rim = found.cone[:, 1] - [0.1, 0.0, 0.0]
    np.testing.assert_allclose(np.linalg.norm(rim[:, :2], axis=1) / rim[:, 2], 0.5)
    assert len(found.support) == 0  # one point spans nothing


def test_the_support_is_the_hull_of_the_contacts_that_carry_something():
    """All of a sole supports, also while its load is at the toes."""
    corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
    contacts = {"sole": corners, "inside": [(0.4, 0.5, 0.0)], "in the air": [(5.0, 5.0, 0.0)]}
    forces = np.tile([0.0, 0.0, 10.0], (1, 6, 1))
    forces[0, [0, 3, 5]] = 0.0
    found = drawn(contacts, forces)
    assert sorted(map(tuple, found.support[:, 0])) == sorted(corners)
    np.testing.assert_array_equal(found.support[:, 1], np.roll(found.support[:, 0], -1, axis=0))
    assert len(found.force) == 6
    assert len(found.cone) == 3 * 16  # where there is load
    forces[0, 1] = np.nan
    assert len(drawn(contacts, forces).force) == 5


def test_a_cross_on_the_floor_is_below_the_centre_of_mass():
    found = drawn({"sole": [(0.0, 0.0, 0.0)]}, np.zeros((1, 1, 3)), np.array([[0.1, 0.2, 0.8]]))
    np.testing.assert_allclose(found.centre.mean(axis=1), [[0.1, 0.2, FACTS.robot.floor]] * 2)
    assert drawn({"sole": [(0.0, 0.0, 0.0)]}, np.zeros((1, 1, 3))).centre.size == 0


def test_an_arrow_goes_to_the_middle_of_a_pushed_body_while_it_is_pushed():
    scenario = STANDING.with_changes({"plant.pushes.0": {
        "joint": "trunk_pitch", "force": 100.0, "direction": 90.0, "at": 0.2, "duration": 0.1}})
    t = np.array([0.199, 0.2, 0.299, 0.3])
    rest = FACTS.robot.placements(np.array(FACTS.robot.rest))
    found = pushes(FACTS, scenario, t, np.tile(rest, (4, 1, 1)), np.zeros((4, 8, 3)))
    assert [len(found.at(f).push) for f in range(4)] == [0, 5, 5, 0]
    shaft, *head = found.at(1).push
    np.testing.assert_allclose(shaft[1] - shaft[0], [0.0, 0.2, 0.0], atol=1e-12)
    assert all((barb[1] == shaft[1]).all() and barb[0, 1] < shaft[1, 1] for barb in head)
    sideways = np.linalg.norm(np.subtract(*np.swapaxes(head, 0, 1))[:, ::2], axis=1)
    np.testing.assert_allclose(sideways, 0.4 * (shaft[1, 1] - np.array(head)[:, 0, 1]))
    assert abs(shaft[1, 1]) < 1e-9
    assert shaft[1, 2] > rest[:, 11].mean()  # in the trunk


@pytest.mark.parametrize("name", ["reach-torque", "stand-momentum", "wipe", "step", "crawl"])
def test_every_shipped_scenario_of_torques_can_be_replayed(name):
    """A level of momentum had no name for its curve; a position in two axes had three."""
    pytest.importorskip("mujoco")
    run = simulate(load(name).with_changes({"control.duration": 0.01}))
    names = [one.name for one in scene(run).series]
    assert len(set(names)) == len(names)
    assert "</html>" in html({"a": run}, name)
    live = Live(run.scenario)
    live.tick()
    for now, path in zip(live.frame().paths, scene(run).paths, strict=True):
        np.testing.assert_allclose(now.actual[0], path.actual[0], atol=1e-9)
        assert (now.wanted is None) == (path.wanted is None)
        if name == "wipe":
            assert (scene(run).pushes.table[..., 2] == load(name).plant.height).all()
        if path.wanted is not None:
            np.testing.assert_allclose(now.wanted[0], path.wanted[0], atol=1e-9)
