"""The letter's simulation against runs of its authors' code (tests/data/ellipse)."""

from pathlib import Path

import numpy as np
import pytest

from scenarios.config import load
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate

DATA = Path(__file__).parents[1] / "data" / "ellipse"

AS_PUBLISHED = ["control.jacobian_derivative=difference"]
RUNS = {
    "inequality_5deg": ("ellipse", AS_PUBLISHED),
    "inequality_35deg": ("ellipse-35deg", AS_PUBLISHED),
    "equality_35deg": ("ellipse-35deg-equality", AS_PUBLISHED),
    "avoidance_3d_first5s": ("ellipse-3d", [*AS_PUBLISHED, "control.duration=5.0"]),
    "published_jacobians_inequality_5deg": ("ellipse-published", []),
}


def reference(name):
    with np.load(DATA / f"{name}.npz") as file:
        return dict(file)


@pytest.mark.slow
@pytest.mark.parametrize("name", RUNS)
def test_the_authors_runs_are_reproduced_tick_for_tick(name):
    expected = reference(name)
    run = simulate(load(*RUNS[name]))
    every = slice(None, None, 10)
    assert run.fault is None
    assert run.ticks == (5000 if name.endswith("5s") else 18850)
    np.testing.assert_allclose(run["t"][every], expected["t"], atol=1e-12)
    np.testing.assert_array_equal(run["active_control_point"][every],
                                  expected["active_control_point"])
    np.testing.assert_allclose(run["q"][every], expected["q"], rtol=0, atol=1e-8)
    np.testing.assert_allclose(run["v"][every], expected["v"], rtol=0, atol=1e-6)
    np.testing.assert_allclose(run["a"][9::10][:len(expected["t"]) - 1],
                               expected["a_previous"][1:], rtol=0, atol=1e-5)
    np.testing.assert_allclose(run["position_error"][every], expected["position_error"],
                               rtol=0, atol=1e-8)
    np.testing.assert_allclose(run["pointing_error"][every], expected["pointing_error"],
                               rtol=0, atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["inequality_5deg", "inequality_35deg", "equality_35deg"])
def test_exact_derivatives_command_nearly_the_same_from_every_recorded_state(name):
    expected = reference(name)
    scenario = load(RUNS[name][0])
    T, controller = scenario.control.period, Controller(scenario)
    differences = []
    for k in range(1, len(expected["t"])):
        # The state of the tick before, whose command was recorded: undo one integration.
        a = expected["a_previous"][k]
        v = expected["v"][k] - a * T
        q = expected["q"][k] - v * T - a * T * T / 2
        command = controller.command(expected["t"][k] - T, q, v)
        differences.append(np.abs(command - a).max())
    assert max(differences) < 0.1
    assert np.median(differences) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("name", ["inequality_5deg", "inequality_35deg", "equality_35deg"])
def test_exact_derivatives_leave_the_stack_of_every_recorded_state_as_it_was(name):
    expected = reference(name)
    controller = Controller(load(RUNS[name][0]))
    always = name.startswith("equality")
    for t, q, v, active, error in zip(
            *(expected[key] for key in ("t", "q", "v", "active_control_point",
                                        "pointing_error")), strict=True):
        controller.command(t, q, v)
        order = controller.allocation.order
        seen = controller.cell.sensor.measurement
        assert (seen.active + 1 if "avoidance" in order else -1) == active
        assert ("pointing" in order) == (always or error > 0)
