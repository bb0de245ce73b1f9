"""Batches: each problem gets what it gets alone, to the last bit, on any number of threads."""

import os

import numpy as np
import pytest
from rank_cases import boxed, family, gap, moved, rng
from refusals import refused

from hierarchy import Hierarchy
from solvers import Status, make
from solvers.batch import Batch, solve

SLOW = os.environ.get("NUMBA_DISABLE_JIT") == "1"
FEW = 12 if SLOW else 50
COPIES = 1 if SLOW else 4  # of a family's 50 problems, each with targets of its own


@pytest.fixture(autouse=True)
def threads_for_small_batches(monkeypatch):
    monkeypatch.setattr("solvers.batch.ENOUGH", 1)


def problems_of(of, copies=COPIES):
    """Problems with bounds of +-`of`; or those of a family, and copies with other references."""
    r = rng(7)
    if isinstance(of, float):
        return [bounded(seed, of) for seed in range(20)]
    originals = [h for h, _, _ in family(of)][:FEW]
    return originals + [h.changed(reference=h.reference + r.normal(size=h.n))
                        for _ in range(copies - 1) for h in originals]


def bounded(seed, half):
    """Bounds on the joints over two levels of three rows."""
    r = rng(seed)
    levels = [(r.normal(size=(3, 7)), r.normal(size=3)) for _ in range(2)]
    return boxed(Hierarchy.from_levels(levels, r.normal(size=7)), -half, half)


def assert_same(answer, alone):
    for p, res in enumerate(alone):
        np.testing.assert_array_equal(answer.x[p], res.x)
        assert (answer.status[p], answer.iterations[p]) == (res.status, res.iterations)
        if res.memory is not None:
            np.testing.assert_array_equal(answer.memory[p], res.memory)
        elif answer.memory is not None:
            assert not answer.memory[p].any()


@pytest.mark.parametrize("threads", [1, 3])
@pytest.mark.parametrize(("resolver", "of"), [
    *((make("tpm"), of) for of in ("EQ7", "EQ7over", "EQ7sing", "EQ30L8")),
    *((make("hcod"), of) for of in ("EQ7", "EQ7sing", "INEQ7", "DEGEN7", "HUM38")),
    *((make(name, damping=damping), half)
      for name in ("tpm", "hcod") for damping in (0.0, 0.1) for half in (0.05, 0.3, 3.0)),
    *(pytest.param(make("merged", scales={"level 3": 3.0}), half, marks=pytest.mark.slow)
      for half in (0.05, 0.3, 3.0))], ids=str)  # slow to compile
def test_each_problem_gets_what_it_gets_alone_and_its_memory_too(resolver, of, threads):
    hs = problems_of(of, 1 if of in ("HUM38", "EQ30L8") else COPIES)
    cold, alone = solve(Batch.of(hs), resolver, threads), [resolver.solve(h) for h in hs]
    assert_same(cold, alone)
    if cold.memory is not None:
        again = [moved(h) for h in hs]
        assert_same(solve(Batch.of(again), resolver, threads, cold.memory), [
            resolver.solve(h, res.memory) for h, res in zip(again, alone, strict=True)])


@pytest.mark.parametrize("name", ["tpm", "hcod"])
@pytest.mark.parametrize("spoil", ["A", "crossed"])
def test_one_spoilt_problem_fails_alone(name, spoil):
    batch = Batch.of(problems_of("EQ7", copies=1))
    expected = solve(batch, make(name)).x
    if spoil == "crossed":
        batch.lower[7, 1] = batch.upper[7, 1] + 1.0
    else:
        getattr(batch, spoil)[7].flat[1] = np.nan
    answer = solve(batch, make(name))
    assert (answer.status[7], answer.x[7].any()) == (Status.NUMERICAL_FAILURE, False)
    others = np.arange(len(batch)) != 7
    assert answer.solved[others].all()
    np.testing.assert_array_equal(answer.x[others], expected[others])


def arrays(**wrong):
    return Batch(**{"A": np.ones((4, 3, 5)), "lower": np.ones((4, 3)), "upper": np.ones((4, 3)),
                    "sizes": [2, 1], **wrong})


@pytest.mark.parametrize(("call", "named"), [
    (lambda: arrays(A=np.ones((4, 3))), "A has shape (4, 3)"),
    (lambda: arrays(A=1j * np.ones((4, 3, 5))), "A is not an array of real"),
    (lambda: arrays(lower=np.ones((4, 2))), "lower has shape (4, 2), expected (4, 3)"),
    (lambda: arrays(upper="high"), "upper"), (lambda: arrays(reference=np.ones((5, 4))), "refer"),
    (lambda: Batch.of([Hierarchy.from_levels([(np.eye(3)[:k], np.ones(k))]) for k in (2, 1)]),
     "problem 1"), (lambda: Batch.of([]), "no hierarchies"),
    (lambda: Batch.of(None), "Batch.of: hierarchies: expected an Iterable, got NoneType None"),
    (lambda: Batch.of([1]), "problem 0: expected a Hierarchy"),
    (lambda: Batch.of([Hierarchy.from_levels([([[1.0, 0.3]], [1.0])], metric=np.eye(2))]),
     "problem 0 has a metric"),
    (lambda: solve(arrays(), make("recursive")), "recursive resolves no batches"),
    (lambda: solve(arrays(), make("tpm-published")), "tpm-published resolves no batches"),
    (lambda: solve(arrays(), threads=0), "threads = 0"),
    (lambda: solve(arrays(upper=2 * np.ones((4, 3))), make("tpm")), "problem 0, level 1, row 0")])
def test_what_makes_no_batch_is_named(call, named):
    refused(named, call)


@pytest.mark.parametrize("name", ["tpm", "hcod"])
@pytest.mark.parametrize("shape", [(0, 3), (4, 0), (1, 3)])
def test_a_batch_may_be_empty_or_without_rows(name, shape):
    count, m = shape
    A, b = rng(0).normal(size=(count, m, 5)), np.ones(shape)
    answer = solve(Batch(A, b, b, [m], np.ones((count, 5))), make(name))
    assert answer.x.shape == (count, 5)
    assert answer.solved.all()
    assert m or (answer.x == 1.0).all()


def test_jax_agrees_with_the_kernel_fails_alone_and_refuses():
    pytest.importorskip("jax")
    from solvers.batch import on_jax

    for of, damping in (("EQ7over", 0.0), ("EQ7sing", 0.0), ("EQ7sing", 0.05)):
        batch, resolver = Batch.of(problems_of(of)), make("tpm", damping=damping)
        ours, theirs = solve(batch, resolver), on_jax.solve(batch, resolver)
        np.testing.assert_array_equal(ours.status, theirs.status)
        assert max(map(gap, theirs.x, ours.x)) < 1e-9
    batch = Batch.of(problems_of("EQ7", copies=1))
    batch.A[3, 0, 0], batch.lower[5, 0] = np.nan, np.inf
    answer = on_jax.solve(batch)
    assert np.flatnonzero(~answer.solved).tolist() == [3, 5]
    assert not answer.x[[3, 5]].any()
    assert max(map(gap, answer.x, solve(batch).x)) < 1e-9
    batch.upper[11, 4] += 1.0
    refused("problem 11, level 3, row 0: an inequality", on_jax.solve, batch)
    refused("hcod is not available in jax", lambda: on_jax.solve(batch, make("hcod")))
