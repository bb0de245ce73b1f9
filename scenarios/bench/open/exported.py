"""Problems written as files, and files judged anew."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scenarios.bench.open.answered import Progress, answer, with_answers
from scenarios.bench.open.families import Family
from scenarios.files import named, written
from solvers.problems.files import Collection
from solvers.proof import Proof

_SAME = 1e-9  # relative to 1 + the value


def file_of(folder: Path, family: str, seed: int) -> Path:
    """Return the path of a half's file."""
    return folder / f"{family}-{f'fresh-{seed}' if seed else 'public'}.npz"


def export(family: Family, seed: int, count: int | None, answers: bool, folder: Path,
           progress: Progress | None = None) -> Path:
    """Write a half of a family into the folder, and return the file."""
    made = family.half(seed, count)
    return save(with_answers(made, progress) if answers else made, folder)


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
