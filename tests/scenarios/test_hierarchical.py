"""Limits, separation, cones and listed tasks in one stack at all times."""

import numpy as np
import pytest
from scene import ROBOT

from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.loop.controller import Controller
from scenarios.measure.metrics import measure
from solvers import certify


def names_of(*changes):
    return build(load("ellipse-hqp", changes)).order(None, 0.0).order


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("resolver", ["hcod", "weighted"])
def test_limits_and_distances_are_kept_and_no_tick_fails(level, resolver):
    changes = ["control.duration=1.5", f"control.level={level}"]
    scenario = load("ellipse-hqp", changes).with_resolver(resolver)
    certified = resolver == "hcod"  # at velocity level of levels that were calmed
    run = simulate(scenario, certified=certified)
    assert run.fault is None
    assert (run["status"] == 0).all()
    assert np.maximum(run["q"] - run["joint_upper"], run["joint_lower"] - run["q"]).max() <= 1e-9
    assert (np.abs(run["v"]) - run["velocity_limit"]).max() <= 1e-9
    assert np.abs(run["a"]).max() <= 10.0 * (1.0 + 1e-6)
    assert run["minimal_distance"].min() >= scenario.avoidance.distance - 1e-4
    assert not certified or run["certified"].all()


def test_the_order_is_fixed_and_limits_come_first():
    assert names_of() == ("joint limits", "separation", "position", "pointing")
    assert names_of("limits.torque=0.5") == ("joint limits", "torque limits", "separation",
                                             "position", "pointing")
    assert names_of("avoidance.self_collision=0.02")[1:3] == ("separation", "self-separation")
    assert names_of("posture={role='task', target=[0,0,0,0,0,0,0]}")[-1] == "posture"


def test_the_strictness_scenario_measures_what_a_lower_task_moves():
    scenario = load("strictness", ["control.duration=0.3"])
    strict, weighted = (measure(simulate(one))["moved_by_lower_max"].value for one in (
        scenario, scenario.with_resolver("weighted:ratio=10")))
    assert strict < 1e-9
    assert weighted > 1e-7


BEYOND = [1.1657, -0.9476, 0.5844, float(ROBOT.upper[3]) + 0.1, 1.1464, 1.7695, 0.0]
STARTS = {"stretched": "start.q=[0, 0, 0, 0, 0, 0, 0]",
          "beyond a limit": f"start={{q={BEYOND}, allow_outside_limits=true}}",
          "too fast": "start.v=[3, -3, 3, -3, 4, -3, 3]"}


@pytest.mark.parametrize("how", STARTS)
@pytest.mark.parametrize(("name", "resolver"), [
    ("human", "recursive"), ("human", "sns"), ("human-hqp", "hcod")])
def test_any_start_is_recovered_from_within_the_limit_of_acceleration(name, resolver, how):
    """A joint beyond its limit comes back without going farther out; too fast, it slows down."""
    run = simulate(load(name, ["control.duration=1.0", "plant={kind='kinematic'}", STARTS[how],
                               "sensor={kind='exact'}"]).with_resolver(resolver))
    assert run.fault is None
    assert np.abs(run["command"]).max() <= run.scenario.limits.acceleration * (1.0 + 1e-9)
    out = np.maximum(run["q"] - ROBOT.upper, ROBOT.lower - run["q"])
    assert (np.diff(np.maximum(out, 0.0), axis=0) <= 1e-12).all()
    assert out[60:].max() <= 1e-12
    excess = np.maximum(np.abs(run["v"]) / ROBOT.velocity_limit - 1.0, 0.0)
    assert (np.diff(excess, axis=0) < 1e-9).all()
    assert excess[-1].max() == 0.0


def test_every_command_is_certified_in_the_inertia_of_its_tick():
    """In it bounds are for resolvers of any rows."""
    controller = Controller(load("ellipse-mass"))
    cell = controller.cell
    for tick in range(10):
        x = controller.command(1e-3 * tick, cell.plant.q, cell.plant.v)
        np.testing.assert_array_equal(controller.hierarchy.metric, cell.state.mass_matrix())
        assert certify(controller.hierarchy, x).certified
        cell.plant.act(x)
    assert load("ellipse-limits").asks == "bounds"
    assert load("ellipse-limits", ["control.metric=mass"]).asks == "inequalities"
    assert load("ellipse", ["control.metric=mass"]).asks == "equalities"


def test_all_levels_above_the_posture_are_met_and_their_errors_recorded():
    standing = simulate(load("humanoid"))
    assert standing.fault is None
    found = measure(standing)
    for name in ("left_foot", "right_foot", "centre_of_mass"):
        assert found[f"task_{name}_rms"].value < 1e-5
    for name in ("right_hand", "left_hand"):
        assert found[f"task_{name}_max_settled"].value < 1e-4, "what a period of 5 ms leaves"
        assert found[f"task_{name}_end"].value < 1e-5
    assert found["task_gaze_max_settled"].value < 0.05
    assert found["task_left_foot_turned_rms"].unit == "deg"
    assert found["joint_limit_excess"].value == 0.0
    cell, k = build(standing.scenario), 700
    cell.state.move(standing["t"][k], standing["q"][k], standing["v"][k])
    for task in cell.tasks.listed:
        np.testing.assert_allclose(standing[f"task_error_{task.name.replace(' ', '_')}"][k],
                                   task.error(cell.state), atol=1e-15)
