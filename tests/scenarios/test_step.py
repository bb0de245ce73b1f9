"""The scenario `step`: a foot lifts off and touches down, without a jump of the torques."""

import pytest
from standing import WEIGHT

from scenarios import load, simulate
from scenarios.measure.metrics import measure

BOUND = load("step").limits.torque_step  # [N m]

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("ramp", [0.2, 0.0])
def test_no_torque_jumps_at_lift_off_and_touch_down(ramp):
    """With a ramp the bound is not needed; without one it acts."""
    pytest.importorskip("mujoco")
    run = simulate(load("step").with_changes({"contacts.1.ramp": ramp, "control.duration": 2.3}))
    assert run.fault is None
    step = measure(run)["torque_step_max"].value
    assert step < 0.9 * BOUND if ramp else step == pytest.approx(BOUND, abs=1e-9)
    right = run["floor_force"][:, 1]
    t = run["t"]
    assert (right[(t > 1.21) & (t < 1.79)] == 0.0).all()          # in the air
    assert right[t < 0.3, 2].min() > 1.0
    assert right[(t > 2.05) & (t < 2.15), 2].min() > 1.0
    height = run["task_position_right_foot"][:, 2]
    assert height.max() == pytest.approx(0.04, abs=3e-3)
    assert run["planned_force"][(t > 1.2) & (t < 1.8)][:, 4:].max() < 1e-6
    if ramp:  # the load that is planned goes from what it is to zero and, at most, to the weight
        carried = run["planned_force"][:, 4:, 2].sum(axis=1)
        falls, rises = (t > 1.0) & (t < 1.2), (t > 1.8) & (t < 2.0)
        start = carried[t <= 1.0][-1]
        assert 10.0 < start < 100.0
        assert (carried[falls] <= start * (1.2 - t[falls]) / ramp + 1e-6).all()
        assert (carried[rises] <= WEIGHT * (t[rises] - 1.8) / ramp + 1e-6).all()
