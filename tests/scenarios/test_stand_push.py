"""Torques for robots in contact, from a file to metrics: `stand-push`, `wipe`, `crawl`."""

import numpy as np
import pytest

from scenarios import load, shipped, simulate
from scenarios.measure.metrics import measure

pytest.importorskip("mujoco")


# Not of robots of packages: the certificate rejects 13 of 150 answers of stand-g1, and 2 of
# stand-talos, that are right to 1e-14, as a proof in 120 digits shows.
@pytest.mark.parametrize("name", sorted(
    name for name in shipped() if load(name).control.level == "torque"
    and load(name).make_resolver().strict and ":" not in load(name).robot.model))
def test_every_answer_of_a_shipped_scenario_of_torques_is_certified(name):
    scenario = load(name, {"control.duration": 0.15})
    if scenario.plant.pushes:  # early enough to be part of it
        scenario = scenario.with_changes({"plant.pushes.0.at": 0.02})
    run = simulate(scenario, certified=True)
    assert run["certified"].all(), np.flatnonzero(~run["certified"])


@pytest.mark.parametrize("height", [0.111, 0.09])
def test_it_presses_and_wipes_on_a_table_of_unknown_height(height):
    """Friction known: within 1 N of 20 N most of the time, and a few mm of its circle."""
    run = simulate(load("wipe", {"plant.height": height, "control.duration": 2.4}))
    assert run.fault is None
    after = run["t"] > 1.0
    assert np.median(np.abs(run["floor_force"][after, 0, 2] - 20.0)) < 2.0
    height_kept = run["true_ee_position" if "true_ee_position" in run else "ee_position"][after, 2]
    np.testing.assert_allclose(height_kept, height, atol=3e-3)
    found = measure(run)
    assert found["force_touching_share"].value > 0.85
    assert found["task_path_rms"].value < 6e-3
    assert np.isnan(run["slip"]).any()
    assert not {"slip_max", "stands_at_rest", "com_drop_max"} & {*found}  # it has no feet


def test_a_foot_steps_with_the_weight_over_the_other_three():
    first, lift, touch = 3, 0.75, 1.15  # the foot that steps first, and when [s]
    first_step = simulate(load("crawl", {
        "control.duration": 1.4, "plant.pushes.0.at": 0.3, "plant.pushes.0.force": 20.0}))
    assert first_step.fault is None
    t, force = first_step["t"], first_step["floor_force"]
    air = (t > lift + 0.01) & (t < touch - 0.01)
    assert (force[air, first] == 0.0).all()
    assert force[air][:, [0, 1, 2], 2].min() > 1.0
    assert first_step["support_margin"][air].min() > 0.03
    moved = first_step["task_position_right_hind_foot"]
    np.testing.assert_allclose(moved[-1] - moved[0], [0.12, 0.0, 0.0], atol=5e-3)
    assert moved[:, 2].max() == pytest.approx(0.06, abs=5e-3)
    step = first_step.scenario.limits.torque_step
    assert measure(first_step)["torque_step_max"].value <= step + 1e-9
