"""The recursion, and that recursion and staircase are one answer."""

import numpy as np
import oracle
import pytest
from rank_cases import rng

from hierarchy import Hierarchy
from solvers import make


def stacks(count, seed):
    """Yield random stacks of every shape: rows dropped in rank, repeated, zero, nearly parallel."""
    r = rng(seed)
    for _ in range(count):
        n = int(r.integers(1, 10))
        sizes = r.integers(0, 5, size=r.integers(1, 5))
        A = r.normal(size=(sizes.sum(), n))
        for i in range(len(A)):
            kind = r.integers(0, 8)
            if kind == 0 and i:
                A[i] = r.normal(size=i) @ A[:i]
            elif kind == 1 and i:
                A[i] = A[r.integers(0, i)]
            elif kind == 2:
                A[i] = 0.0
            elif kind == 3 and i:
                A[i] = A[r.integers(0, i)] + 1e-2 * r.normal(size=n)
        b, first, levels = r.normal(size=len(A)), 0, []
        for size in sizes:
            levels.append((A[first:first + size], b[first:first + size]))
            first += size
        yield Hierarchy.from_levels(levels, r.normal(size=n))


@pytest.mark.slow
@pytest.mark.parametrize("damping", [0.0, 0.05, 1.0])
@pytest.mark.parametrize("threshold", [0.1, 2.0])
def test_recursion_staircase_and_oracle_agree_on_random_stacks(damping, threshold):
    settings = {"damping": damping, "threshold": threshold}
    for h in stacks(60, seed=11):
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
