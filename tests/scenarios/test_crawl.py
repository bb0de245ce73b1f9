"""The scenario `crawl`: a quadruped walks one foot at a time, its weight over the other three."""


import numpy as np
import pytest

from scenarios import load, simulate
from scenarios.cell.plants.torque import inside
from scenarios.measure.metrics import measure

CRAWL = load("crawl")
FIRST, LIFT, TOUCH = 3, 0.75, 1.15  # the first foot that steps, and when [s]


@pytest.mark.slow
def test_a_foot_steps_with_the_weight_over_the_other_three():
    pytest.importorskip("mujoco")
    first_step = simulate(CRAWL.with_changes({
        "control.duration": 1.4, "plant.pushes.0.at": 0.3, "plant.pushes.0.force": 20.0}))
    assert first_step.fault is None
    t, force = first_step["t"], first_step["floor_force"]
    air = (t > LIFT + 0.01) & (t < TOUCH - 0.01)
    assert (force[air, FIRST] == 0.0).all()
    assert force[air][:, [0, 1, 2], 2].min() > 1.0
    assert first_step["support_margin"][air].min() > 0.03
    moved = first_step["task_position_right_hind_foot"]
    np.testing.assert_allclose(moved[-1] - moved[0], [0.12, 0.0, 0.0], atol=5e-3)
    assert moved[:, 2].max() == pytest.approx(0.06, abs=5e-3)
    assert measure(first_step)["torque_step_max"].value <= CRAWL.limits.torque_step


@pytest.mark.parametrize(("place", "found"), [
    ((0.5, 0.5), 0.5), ((0.9, 0.4), 0.1), ((1.2, 0.5), -0.2), ((0.0, 0.3), 0.0)])
def test_the_margin_of_support_is_that_from_the_nearest_edge(place, found):
    corners = np.array([(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.2), (0.0, 0.0)])
    assert inside(corners, np.array(place)) == pytest.approx(found)
    assert np.isnan(inside(corners[:2], np.array(place)))
