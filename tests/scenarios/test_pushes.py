"""What is drawn of a run: frames, levels, forces, friction cones, pushes."""

from dataclasses import replace

import numpy as np
import pytest
from hand_made import recording as hand_made

from hierarchy import Robot
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.draw.replay import html
from scenarios.draw.viewer.live import Live
from scenarios.loop.controller import Controller
from scenarios.measure.judging import judge
from scenarios.recording.facts import ContactPoint, facts_of
from scenarios.recording.fate import Fate, levels_at
from scenarios.scene.drawn import scene
from scenarios.scene.pushes import Pushes, pushes

STANDING = load("stand-push")
FACTS = facts_of(STANDING, Robot.named("humanoid"))


def drawn(contacts, forces):
    """What is drawn of points of contacts, by name, of a base at the origin."""
    points = tuple(ContactPoint(name, 0, tuple(map(float, p)), (0.0, 0.0, 1.0), 0.5)
                   for name, of in contacts.items() for p in of)
    origin = np.r_[np.eye(3).ravel(), np.zeros(3)][None, None]
    found = pushes(replace(FACTS, contacts=points), load("step"), np.zeros(1), origin,
                   np.asarray(forces, dtype=float))
    return at(found, 0)


def at(found, frame):
    """The segments of a frame that exist."""
    return Pushes(*(part[frame][np.isfinite(part[frame]).all(axis=(1, 2))] for part in found))


def test_the_support_is_the_hull_of_the_contacts_that_carry_something():
    """All of a sole supports, also while its load is at the toes."""
    corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)]
    contacts = {"sole": corners, "inside": [(0.4, 0.5, 0.0)], "in the air": [(5.0, 5.0, 0.0)]}
    forces = np.tile([0.0, 0.0, 10.0], (1, 6, 1))
    forces[0, [0, 3, 5]] = 0.0
    found = drawn(contacts, forces)
    assert sorted(map(tuple, found.support[:, 0])) == sorted(corners)
    np.testing.assert_array_equal(found.support[:, 1], np.roll(found.support[:, 0], -1, axis=0))
    assert (len(found.force), len(found.cone)) == (6, 3 * 16)  # a cone where there is load
    forces[0, 1] = np.nan
    assert len(drawn(contacts, forces).force) == 5
    for x, y, places in ((0.0, 1.0, (2, 1, 3)), (1.0, 0.0, (3, 1))):  # along a line its ends
        toes = {"toes": [(x * k, y * k, 0.0) for k in places]}
        edge = drawn(toes, forces[:, 2:2 + len(places)]).support
        np.testing.assert_array_equal(edge[:, 0], [(x, y, 0.0), (3 * x, 3 * y, 0.0)])


def test_an_arrow_goes_to_the_middle_of_a_pushed_body_while_it_is_pushed():
    scenario = STANDING.with_changes({"plant.pushes.0": {
        "joint": "trunk_pitch", "force": 100.0, "direction": 90.0, "at": 0.2, "duration": 0.1}})
    t = np.array([0.199, 0.2, 0.299, 0.3])
    rest = FACTS.robot.placements(np.array(FACTS.robot.rest))
    bare = replace(FACTS, robot=replace(FACTS.robot, capsules=()))  # to the joint, without bodies
    found, to_joint = (pushes(facts, scenario, t, np.tile(rest, (4, 1, 1)), np.zeros((4, 8, 3)))
                       for facts in (FACTS, bare))
    trunk = FACTS.robot.joint_names.index("trunk_pitch") + 1
    np.testing.assert_array_equal(at(to_joint, 1).push[0, 1], rest[trunk, 9:])
    assert [len(at(found, f).push) for f in range(4)] == [0, 5, 5, 0]
    shaft, *head = at(found, 1).push
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


NAMES = ("ellipse", "ellipse-velocity", "ellipse-published", "ellipse-limits", "ellipse-hqp")


@pytest.fixture(scope="module")
def recording():
    return simulate(load("ellipse", ["control.duration=1.5"]))


@pytest.mark.parametrize("name", NAMES)
def test_violations_are_those_of_the_hierarchy_that_was_resolved(name):
    """A second run asks the loop's own hierarchy, tick by tick, what its command violates."""
    scenario = load(name, ["control.duration=0.2", "start.v=[0.1, -0.1, 0, 0.2, 0, 0.1, 0]"])
    controller = Controller(scenario)
    plant, seen = controller.cell.plant, []
    for k in range(200):
        x = controller.command(k * scenario.control.period, plant.q, plant.v)
        seen.append(dict(zip(controller.hierarchy.names, controller.hierarchy.violations(x),
                             strict=True)))
        plant.act(x)
    levels = levels_at(simulate(scenario), range(200))
    assert (levels.fate != Fate.UNKNOWN).all()
    for found, fates, expected in zip(levels.violation, levels.fate, seen, strict=True):
        for task, violation, fate in zip(levels.names, found, fates, strict=True):
            assert np.isclose(violation, expected.get(task, np.nan), atol=1e-9, equal_nan=True)
            assert (fate == Fate.ABSENT) == (task not in expected)
            assert (fate == Fate.MISSED) == (violation > 1e-5) or 1e-9 < violation < 1e-3


def test_distances_that_are_not_those_recorded_leave_levels_unknown(recording):
    moved = recording["control_point_distance"] + 1e-3
    other = replace(recording, signals=recording.signals | {"control_point_distance": moved})
    judge(other, build(recording.scenario))
    levels = levels_at(other, [0, 700])
    assert (levels.fate == Fate.UNKNOWN).any(axis=1).all()
    assert np.isnan(levels.violation).all()


def test_no_peak_between_two_frames_is_lost(recording):
    for curve, values in zip(scene(recording, rate=4.0).series, scene(recording, 5000.0).series,
                             strict=True):
        assert np.allclose(curve.low.min(axis=0), values.value.min(axis=0))
        assert np.allclose(curve.high.max(axis=0), values.value.max(axis=0))
        assert ((curve.low <= curve.value) & (curve.value <= curve.high)).all()


def test_frames_end_where_the_state_stops_being_finite():
    q = np.zeros((5, 7))
    q[3:] = np.nan
    assert scene(hand_made(q=q, order=np.zeros(5, int)), rate=1.0).ticks.tolist() == [0, 1, 2]


def test_levels_that_were_not_judged_are_unknown_where_they_are_in_the_stack():
    levels = levels_at(hand_made(orders=("a", "a > b"), order=[0, 1, 1, 0, 0]), [0, 1, 4])
    assert levels.names == ("a", "b")
    assert levels.fate.tolist() == [[Fate.UNKNOWN, Fate.ABSENT], [Fate.UNKNOWN, Fate.UNKNOWN],
                                    [Fate.UNKNOWN, Fate.ABSENT]]
    assert levels_at(hand_made(orders=("",)), [0, 4]).fate.shape == (2, 0)  # nothing was stacked
