"""True distances beside measured ones, and the sets of rows that act."""

from types import SimpleNamespace

import numpy as np
import pytest

from hierarchy import Hierarchy, Robot, State
from scenarios.config import load
from scenarios.loop.audit import ActiveSets
from scenarios.loop.simulation import simulate
from solvers import Resolution, Status, make

HAND = ["control.duration=0.2", "plant.kind=kinematic"]


def by_hand(robot, q, centre, radius):
    """Distances (K,) of the control points and the end effector to one sphere."""
    state, end = State.at(robot, q), robot.frame(robot.end_effector)
    points = [(p.joint, p.offset) for p in robot.control_points] + [(end.joint, end.offset)]
    found = []
    for joint, offset in points:
        rotation = state.placements[joint][:9].reshape(3, 3).T  # stored column by column
        where = state.placements[joint][9:] + rotation @ np.asarray(offset)
        found.append(np.linalg.norm(where - centre) - radius)
    return np.array(found)


def sphere(radius, centre):
    return ["avoidance.obstacles=[{shape = 'sphere', "
            f"radius = {radius}, centre = {list(centre)}}}]"]


NEAR, BESIDE = (0.1, 0.5, 0.1), (0.1, 0.75, 0.3)


@pytest.mark.parametrize(("name", "changes", "centre", "radius", "q"), [
    ("ellipse", ["control.duration=0.05", *sphere(0.05, NEAR),
                 "plant.measurement.position_noise=0.01"], NEAR, 0.05, "true_q"),
    pytest.param("human-hqp", [*HAND, *sphere(0.06, BESIDE),
                               "plant.measurement.velocity_noise=0.0",
                               "plant.measurement.quantisation=0.0"], BESIDE, 0.06, "q",
                 marks=pytest.mark.slow)], ids=["noise of the joints", "camera"])
def test_true_distances_are_on_record_beside_the_measured(name, changes, centre, radius, q):
    run, robot = simulate(load(name, changes)), Robot.named("kuka_lwr")
    for k in (0, 7, run.ticks - 1):
        wanted = by_hand(robot, run[q][k], centre, radius)
        np.testing.assert_allclose(run["true_control_point_distance"][k], wanted[:-1], atol=1e-12)
        assert run["true_ee_distance"][k] == pytest.approx(wanted[-1], abs=1e-12)
        assert run["true_minimal_distance"][k] == pytest.approx(wanted[:-1].min(), abs=1e-12)
    assert np.abs(run["true_ee_distance"] - run["ee_distance"]).max() > 1e-3


def noted(sets, hierarchies, resolver="hcod"):
    return [sets.number(h, make(resolver).solve(h)) for h in hierarchies]


def bounded(target, box=1.0, names=("box", "task")):
    """One unknown in a box of its own, and one that is asked for in vain beyond it."""
    return Hierarchy.from_levels([(np.eye(2), -box * np.ones(2), box * np.ones(2)),
                                  (np.eye(2), np.array(target, float))], names=names)


@pytest.mark.parametrize("resolver", ["hcod", "tpm", "sns", "weighted"])
def test_a_row_acts_where_its_side_holds_the_task_back(resolver):
    rows = [bounded((0.0, 0.5)), bounded((2.0, 0.5)), bounded((3.0, 0.5)), bounded((-2.0, 0.5)),
            bounded((-2.0, 5.0)), bounded((0.2, 0.1))]
    assert noted(ActiveSets(), rows, resolver) == [0, 1, 1, 2, 3, 0]


def test_a_tick_without_an_answer_or_without_a_report_has_no_set():
    sets, h = ActiveSets(), bounded((2.0, 0.5))
    tick = SimpleNamespace(hierarchy=h, resolution=Resolution(np.zeros(2)))
    assert sets(0, tick) == {}
    tick.resolution = make("hcod").solve(h)
    assert sets(1, tick) == {"active_set": 0}
    tick.resolution = make("hcod").solve(h)
    tick.resolution.status = Status.ITERATION_LIMIT
    assert sets(2, tick) == {"active_set": -1}
