"""Batches: each problem gets what it gets alone, to the last bit, on any number of threads."""

import os

import numpy as np
import pytest
from rank_cases import CASES, build, family, rng

from hierarchy import Hierarchy
from solvers import batch as batches
from solvers import make
from solvers.batch import Batch, solve

SLOW = os.environ.get("NUMBA_DISABLE_JIT") == "1"
COPIES = 1 if SLOW else 20  # of a family's 50 problems, each with targets of its own
EQUALITIES = ("EQ7", "EQ7over", "EQ7sing", "EQ30L8")
INEQUALITIES = ("INEQ7", "DEGEN7", "HUM38")

both = pytest.mark.parametrize("name", ["tpm", "hcod"])


@pytest.fixture(autouse=True)
def threads_for_small_batches(monkeypatch):
    monkeypatch.setattr(batches, "ENOUGH", 1)


def problems_of(name, copies=COPIES):
    """The problems of a reference family, and copies with other targets and references."""
    r, originals = rng(7), [h for h, _, _ in family(name)]
    found = list(originals)
    for _ in range(copies - 1):
        for h in originals:
            x = h.reference + r.normal(size=h.n)
            found.append(Hierarchy(h.A, h.lower, h.upper, h.sizes, x, h.names))
    return found


def bounded(seed, half, L=2):
    """Bounds on the joints over L levels of three rows."""
    r, n = rng(seed), 7
    levels = [(np.eye(n), -half * np.ones(n), half * np.ones(n))]
    levels += [(r.normal(size=(3, n)), r.normal(size=3)) for _ in range(L)]
    return Hierarchy.from_levels(levels, r.normal(size=n))


def assert_same(answer, alone):
    for p, res in enumerate(alone):
        np.testing.assert_array_equal(answer.x[p], res.x)
        assert answer.status[p] == res.status
        assert answer.iterations[p] == res.iterations
        if res.memory is not None:
            np.testing.assert_array_equal(answer.memory[p], res.memory)
        elif answer.memory is not None:
            assert not answer.memory[p].any()


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize(("name", "of"), [*(("tpm", of) for of in EQUALITIES), *(
    ("hcod", of) for of in ("EQ7", "EQ7sing", *INEQUALITIES))])
def test_each_problem_gets_what_it_gets_alone(name, of, threads):
    resolver, hs = make(name), problems_of(of, 1 if of in ("HUM38", "EQ30L8") else COPIES)
    assert_same(solve(Batch.of(hs), resolver, threads), [resolver.solve(h) for h in hs])


@both
@pytest.mark.parametrize("case", CASES, ids=lambda case: case.__name__)
@pytest.mark.parametrize("settings", [{}, {"damping": 0.05}], ids=["undamped", "damped"])
def test_a_batch_agrees_at_any_rank(name, case, settings):
    resolver, h = make(name, **settings), build(case, with_reference=True)
    assert_same(solve(Batch.of([h, h]), resolver), [resolver.solve(h)] * 2)
