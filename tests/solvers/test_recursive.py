"""The recursion, and that recursion and staircase are one answer."""

import numpy as np
import oracle
import pytest

from hierarchy import Hierarchy
from solvers import make
from solvers.problems import Recipe, generate

ANY_SHAPE = Recipe(equalities_only=True, joints=(1, 10), levels=(1, 5), rows=(0, 5), duplicates=0.3,
                   zero_rows=0.2, near_parallel=0.2, angles=(1e-2, 1e-1), scales=(1.0, 1.0),
                   spread=1.0)


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.0, 0.05, 1.0])
@pytest.mark.parametrize("threshold", [0.1, 2.0])
def test_recursion_staircase_and_oracle_agree_on_random_stacks(damping, threshold):
    settings = {"damping": damping, "threshold": threshold}
    for seed in range(60):
        h = generate(seed, ANY_SHAPE)
        expected = oracle.solve(h, **settings)
        for name in ("recursive", "tpm"):
            x = make(name, **settings).solve(h).x
            assert np.abs(x - expected).max() <= 1e-9 * (1.0 + np.abs(expected).max())


def test_damped_levels_hand_an_undamped_null_space_down():
    """Else damping one level would let the next one spoil it."""
    A = np.array([[1.0, 0.0, 0.0], [1.0, 1e-4, 0.0]])
    upper, lower = (A, [1.0, -1.0]), ([[1.0, 1.0, 1.0]], [5.0])
    for name in ("recursive", "tpm"):
        resolver = make(name, damping=0.05)
        alone = Hierarchy.from_levels([upper])
        both = Hierarchy.from_levels([upper, lower])
        x = resolver.solve(both).x
        assert abs(both.violations(x)[0] - alone.violations(resolver.solve(alone).x)[0]) < 1e-12
        assert both.violations(x)[1] < 1e-12
