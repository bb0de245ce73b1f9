"""Work space: made larger when needed, one for each thread, and its content never matters."""


import numpy as np
import pytest

from hierarchy import Hierarchy
from solvers import Status, make
from solvers.workspace import WORKSPACE

KERNELS = [make("tpm"), make("sns"), make("tpm-published"), make("recursive"), make("augmented"),
           make("hcod"), make("hcod", damping=0.1), make("tpm", damping=0.1),
           make("tpm-published", damping=0.1)]


def levels(n, inequalities, seed=0):
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(4, n // 3, n)), rng.normal(size=(4, n // 3))
    return Hierarchy.from_levels(
        [(A[k], b[k], b[k] + 1.0) if inequalities and k % 2 else (A[k], b[k]) for k in range(4)])


def repeating(h):
    """The hierarchy with the first row of its first level in its first and second level twice."""
    for row in (1, h.sizes[0]):
        h.A[row], h.lower[row], h.upper[row] = h.A[0], h.lower[0], h.upper[0]
    return h


def problems(resolver, n):
    yield levels(n, False)
    yield repeating(levels(n, False))
    if resolver.handles == "inequalities" and not resolver.damping:
        yield levels(n, True)


@pytest.mark.parametrize("resolver", KERNELS, ids=str)
def test_it_grows_with_the_hierarchy(resolver, monkeypatch):
    for h in problems(resolver, 60):
        monkeypatch.setattr(WORKSPACE, "array", np.empty(1))
        small = resolver.solve(h)
        monkeypatch.setattr(WORKSPACE, "array", np.empty(1_000_000))
        assert small.status is Status.SOLVED
        np.testing.assert_array_equal(small.x, resolver.solve(h).x)


@pytest.mark.parametrize("resolver", KERNELS, ids=str)
@pytest.mark.parametrize("left", [np.nan, np.inf, 1e300])
def test_what_was_left_in_it_does_not_matter(resolver, left, monkeypatch):
    for h in problems(resolver, 9):
        before = resolver.solve(h).x
        monkeypatch.setattr(WORKSPACE, "array", np.full(4096, left))
        np.testing.assert_array_equal(resolver.solve(h).x, before)
