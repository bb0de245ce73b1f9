"""Proved answers for a collection: resolvers give candidates, `solvers.proof` decides."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

from hierarchy.problem import Array, Hierarchy
from solvers import make
from solvers.problems.files import Collection
from solvers.proof import Proof, prove
from solvers.qp.backends import installed
from solvers.resolver import Resolver

_BACKENDS = ("daqp", "quadprog", "clarabel", "proxqp")

Progress = Callable[[int, int], None]


def with_answers(collection: Collection, progress: Progress | None = None) -> Collection:
    """Return the collection with what could be proved of each problem.

    progress : told the number of problems done, and their number.
    """
    found = []
    for done, h in enumerate(collection.problems, 1):
        found.append(answer(h))
        if progress is not None:
            progress(done, len(collection.problems))
    return replace(collection, answers=tuple(found))


def answer(h: Hierarchy) -> Proof:
    """Return the proof that the first suitable candidate leads to, or the best of all."""
    best: Proof | None = None
    for x in _candidates(h):
        found = prove(h, [x])
        if found.complete:
            return found
        if best is None or found.judged > best.judged:
            best = found
    assert best is not None
    return best


def _candidates(h: Hierarchy) -> Iterator[Array]:
    for resolver in _resolvers():
        if resolver.name == "recursive" and not h.is_equality:
            continue
        yield resolver.solve(h).x


def _resolvers() -> list[Resolver]:
    return [make("hcod"), *(make("hqp", backend=name) for name in _BACKENDS
                            if installed(name)), make("recursive")]
