"""Proved answers: resolvers give candidates, `solvers.proof` decides; files of both, and checks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from hierarchy.problem import Array, Hierarchy
from scenarios.files import named, written
from scenarios.problems.families import Family
from solvers import make
from solvers.problems.files import Collection
from solvers.proof import Proof, prove
from solvers.qp.backends import installed

_BACKENDS = ("daqp", "quadprog", "clarabel", "proxqp")

Progress = Callable[[int, int], None]

_SAME = 1e-9  # relative to 1 + the value


def answer(h: Hierarchy) -> Proof:
    """Return the proof that the answer of `hcod` leads to, or else the best of all candidates'."""
    found = prove(h, [make("hcod").solve(h).x])
    return found if found.complete else max(found, prove(h, _candidates(h)),
                                            key=lambda one: one.judged)


def _candidates(h: Hierarchy) -> Iterator[Array]:
    for name in filter(installed, _BACKENDS):
        yield make("hqp", backend=name).solve(h).x
    if h.is_equality:
        yield make("recursive").solve(h).x


def file_of(folder: Path, family: str, seed: int) -> Path:
    """Return the path of a set's file."""
    return folder / f"{family}-{f'fresh-{seed}' if seed else 'public'}.npz"


def export(family: Family, seed: int, count: int | None, answers: bool, folder: Path,
           progress: Progress | None = None) -> Path:
    """Write a set of a family into the folder, and return the file.

    answers : whether to prove those that can be. progress : told the number of problems done, and
        their number.
    """
    made, proofs = family.half(seed, count), []
    for done, h in enumerate(made.problems if answers else (), 1):
        proofs.append(answer(h))
        if progress is not None:
            progress(done, len(made.problems))
    return save(replace(made, answers=tuple(proofs)) if answers else made, folder)


def save(collection: Collection, folder: Path) -> Path:
    """Write a collection under its usual name, whole or not at all."""
    file = file_of(folder, collection.head.family, collection.head.seed)
    with named(folder):
        folder.mkdir(parents=True, exist_ok=True)
    with named(file), written(file) as partial:
        collection.save(partial)
    return file


def check(collection: Collection) -> dict[int, str]:
    """Return what is wrong with the answers of a collection, by number of the problem.

    An answer is wrong if one that is proved here has other least violations or another x.
    """
    wrong = {}
    for p, (h, said) in enumerate(zip(collection.problems, collection.answers or (),
                                      strict=collection.answers is not None)):
        difference = _difference(said, answer(h))
        if difference:
            wrong[p] = difference
    return wrong


def _difference(said: Proof, found: Proof) -> str:
    judged = min(said.judged, found.judged)
    off = abs(said.least - found.least)[:judged] > _SAME * (1.0 + abs(found.least[:judged]))
    if off.any():
        k = int(np.argmax(off))
        return f"level {k + 1}: least violation {said.least[k]:.17g}, proved {found.least[k]:.17g}"
    off = abs(said.x - found.x) > _SAME * (1.0 + abs(found.x).max())
    if judged > len(said.least) and off.any():
        i = int(np.argmax(abs(said.x - found.x)))
        return f"x[{i}] is {said.x[i]:.17g}, proved {found.x[i]:.17g}"
    return ""
