"""The letter's simulation against runs of its authors' code (tests/data/ellipse)."""

import numpy as np
import pytest

from benchmark.studies.reference_runs import EVERY, RIGHT, RUNS, differences, reference
from scenarios.config import load
from scenarios.loop.simulation import simulate


@pytest.mark.parametrize("name", RUNS)
def test_the_authors_runs_are_reproduced_tick_for_tick(name):
    expected = reference(name)
    run = simulate(load(*RUNS[name]))
    every = slice(None, None, EVERY)
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


@pytest.mark.parametrize("name", RIGHT)
def test_exact_derivatives_command_nearly_the_same_from_every_recorded_state(name):
    found = differences(name)
    assert len(found) == len(reference(name)["t"]) - 1
    assert max(found) < 0.1
    assert np.median(found) < 1e-3
