from dataclasses import replace

import numpy as np
import pytest
from hand_made import recording as hand_made

from hierarchy import Robot, State
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.loop.controller import Controller
from scenarios.measure.judging import judge
from scenarios.recording.fate import Fate, levels_at
from scenarios.scene import scene

SHORT = ["control.duration=1.5"]
NAMES = ("ellipse", "ellipse-velocity", "ellipse-published", "ellipse-limits", "ellipse-hqp")


@pytest.fixture(scope="module")
def runs():
    return {name: simulate(load(name, SHORT)) for name in NAMES}


@pytest.fixture(scope="module")
def ellipse(runs):
    return scene(runs["ellipse"])


def test_frames_placements_and_distances_are_those_recorded(runs, ellipse):
    assert ellipse.ticks[0] == 0
    assert ellipse.ticks[-1] == runs["ellipse"].ticks - 1
    assert np.abs(np.diff(ellipse.t)[:-1] - 1 / 30).max() < 1.1e-3
    assert np.array_equal(ellipse.t, runs["ellipse"]["t"][ellipse.ticks])
    robot = Robot.named("kuka_lwr")
    for f in (0, 20, -1):
        state = State.at(robot, runs["ellipse"]["q"][ellipse.ticks[f]])
        assert np.allclose(ellipse.placements[f], state.placements, rtol=0.0, atol=1e-14)
        chain = ellipse.links[f]
        assert np.allclose(chain[0, 1], 0.0)  # the foot ends at the base
        assert np.allclose(chain[1:, 0], chain[:-1, 1], atol=1e-12)
        tip = robot.frame(robot.end_effector)
        assert np.allclose(chain[-1, 1], state.position(tip))
        assert np.allclose(ellipse.axis[f], state.rotation(tip)[:, 2])
    recording, ticks = runs["ellipse"], ellipse.ticks
    assert np.allclose(ellipse.traced, recording["ee_position"][ticks], atol=1e-12)
    assert np.allclose(ellipse.distance[:, :-1], recording["control_point_distance"][ticks])
    assert np.allclose(ellipse.distance[:, -1], recording["ee_distance"][ticks])
    away = np.linalg.norm(ellipse.points - ellipse.nearest, axis=2)
    assert np.allclose(away, ellipse.distance)


@pytest.mark.parametrize("name", NAMES)
def test_violations_are_those_of_the_hierarchy_that_was_resolved(name):
    """A second run asks the loop's own hierarchy, tick by tick, what its command violates."""
    scenario = load(name, ["control.duration=0.2"])
    controller = Controller(scenario)
    plant, seen = controller.cell.plant, []
    for k in range(200):
        x = controller.command(k * scenario.control.period, plant.q, plant.v)
        seen.append(dict(zip(controller.hierarchy.names, controller.hierarchy.violations(x),
                             strict=True)))
        plant.act(x)
    levels = levels_at(simulate(scenario), range(200))
    assert levels.known.all()
    for found, fates, expected in zip(levels.violation, levels.fate, seen, strict=True):
        for task, violation, fate in zip(levels.names, found, fates, strict=True):
            assert np.isclose(violation, expected.get(task, np.nan), atol=1e-9, equal_nan=True)
            assert (fate == Fate.ABSENT) == (task not in expected)
            assert (fate == Fate.MISSED) == (violation > 1e-5) or 1e-9 < violation < 1e-3


def test_distances_that_are_not_those_recorded_leave_levels_unknown(runs):
    recording = runs["ellipse"]
    moved = recording["control_point_distance"] + 1e-3
    other = replace(recording, signals=recording.signals | {"control_point_distance": moved})
    judge(other, build(recording.scenario))
    levels = levels_at(other, [0, 700])
    assert not levels.known.any()
    assert np.isnan(levels.violation).all()


def test_no_peak_between_two_frames_is_lost(runs):
    recording = runs["ellipse"]
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
