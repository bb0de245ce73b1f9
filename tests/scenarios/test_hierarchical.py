"""Scenarios whose rows are inequalities: limits, separation and cone in the stack at all times."""

import numpy as np
import pytest

from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.measure.metrics import measure

SHORT = "control.duration=1.5"


def names_of(*changes, scenario="ellipse-hqp"):
    return build(load(scenario, changes)).order(None, 0.0).order


@pytest.mark.slow
@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("resolver", ["hcod", "weighted"])
def test_limits_and_distances_are_kept_and_no_tick_fails(level, resolver):
    scenario = load("ellipse-hqp", [SHORT, f"control.level={level}"]).with_resolver(resolver)
    certified = resolver == "hcod"  # at velocity level of levels that were calmed
    run = simulate(scenario, certified=certified)
    assert run.fault is None
    assert (run["status"] == 0).all()
    excess = np.maximum(run["q"] - run["joint_upper"], run["joint_lower"] - run["q"])
    assert excess.max() <= 1e-9
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


def test_beside_one_sided_distances_algorithm_1_switches_the_cone_alone():
    cell = build(load("ellipse-hqp", ["control.stack=switched"]))
    assert cell.order(None, 1.0).order == ("joint limits", "separation", "position", "pointing")
    assert cell.order(None, -1.0).order == ("joint limits", "separation", "position")
    assert cell.pointing.kind == "equality"


@pytest.mark.slow
def test_the_strictness_scenario_measures_what_a_lower_task_moves():
    strict = measure(simulate(load("strictness", ["control.duration=0.3"])))
    assert strict["moved_by_lower_max"].value < 1e-9
    scenario = load("strictness", ["control.duration=0.3"])
    weighted = simulate(scenario.with_resolver("weighted:ratio=10"))
    assert measure(weighted)["moved_by_lower_max"].value > 1e-7
