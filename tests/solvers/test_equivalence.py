"""Every strict resolver is the same controller: on the runs of the letter, tick for tick."""

import numpy as np
import pytest

from scenarios.config import load
from scenarios.loop.simulation import simulate


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ellipse", "ellipse-velocity"])
def test_hcod_and_recursion_and_the_staircase_are_the_same_run(name):
    """Over all 18,850 ticks, singularities damped alike: (7) equals (5), (12) equals (13)."""
    scenario = load(name)
    staircase, *others = (simulate(scenario.with_resolver(spec))
                          for spec in ("tpm", "recursive", "hcod"))
    for other in others:
        assert other.ticks == staircase.ticks == 18850
        np.testing.assert_allclose(other["q"], staircase["q"], rtol=0, atol=1e-8)
        np.testing.assert_array_equal(other["order"], staircase["order"])
