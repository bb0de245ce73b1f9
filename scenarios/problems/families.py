"""The families of the open benchmark, their files, and proved answers.

Each family makes a public set and fresh ones from a seed. A family of your own is one entry in
FAMILIES: a function from a seed and a count to hierarchies. Seed 0 is the public set, which
everybody may tune on; any other seed is fresh. Resolvers give candidates for an answer, and
`solvers.proof` decides.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import final

import numpy as np

from hierarchy.errors import check_name, refuse
from hierarchy.problem import Hierarchy
from scenarios.config import load
from scenarios.files import named, written
from scenarios.measure.run_folder import version_of
from scenarios.problems import made, recorded
from solvers import make, problems
from solvers.problems.files import FRESH, PUBLIC, Collection, Head
from solvers.problems.kinds import TEXTS
from solvers.proof import Proof, prove
from solvers.qp.backends import installed

COUNT = 50
_CONSECUTIVE = 200
_FEW = 20            # where a proof takes seconds
_SIMULATED = (*recorded.RECORDED, "stand-push")
_STRIDE = 1_000_000  # seeds of single problems between two seeds of sets
_BACKENDS = ("daqp", "quadprog", "clarabel", "proxqp")  # that give candidates
_SAME = 1e-9         # relative to 1 + the value

Make = Callable[[int, int], Sequence[Hierarchy]]
Progress = Callable[[int, int], None]


@final
@dataclass(frozen=True)
class Family:
    """Problems of one kind.

    Attributes
    ----------
    name, group, what : what it is called, which families it goes with, and what it has.
    make : from the seed of the set, 0 for the public one, and a count to that many problems.
    ticks : whether they are consecutive ticks of the scenario of that name.
    usual : number of problems of a set, unless asked otherwise.
    """

    name: str
    group: str
    what: str
    make: Make
    ticks: bool = False
    usual: int = COUNT

    def half(self, seed: int = 0, count: int | None = None) -> Collection:
        """Return the public set (seed 0), or a fresh one; raises HierarchyError."""
        count = self.usual if count is None else count
        refuse(seed < 0 or count < 1, f"family {self.name!r}: seed {seed} and count {count}; "
               "expected a seed of at least 0 and a count of at least 1")
        source = f"task-hierarchy {version('task-hierarchy')}"
        period = load(self.name).control.period if self.ticks else 0.0
        head = Head(self.name, self.what, FRESH if seed else PUBLIC, seed, self.ticks, period,
                    source)
        return Collection(head, tuple(self.make(seed, count)))


def family(name: str) -> Family:
    """Return a family by name; raises UnknownNameError."""
    check_name("family of problems", name, FAMILIES)
    return FAMILIES[name]


def _reference(name: str, seed: int, count: int) -> list[Hierarchy]:
    """Return stored problems, or new ones of the same make."""
    first = seed if name in recorded.RECORDED else seed * _STRIDE
    found = recorded.fresh(name, first, count) if seed else recorded.family(name)
    refuse(count > len(found), f"family {name!r}: its public set has {len(found)} problems, not "
           f"{count}; a seed makes as many fresh ones as asked")
    return [one.h for one in found[:count]]


def _other(name: str, seed: int, count: int) -> list[Hierarchy]:
    make = {"of-soth": made.of_soth, "of-lexls": made.of_lexls, "of-daqp": made.of_daqp}[name]
    return [make(np.random.default_rng([seed, i])) for i in range(count)]


def _generated(name: str, seed: int, count: int) -> list[Hierarchy]:
    return [problems.generate(one) if name == "recipe" else problems.structured(one, (name,))
            for one in range(seed * _STRIDE, seed * _STRIDE + count)]


_REFERENCE = {
    "EQ7": "7 unknowns, equalities in levels of 3, 1, 1",
    "EQ7over": "more rows than unknowns, 3 levels of 3",
    "EQ7sing": "repeated and dependent rows with conflicting targets",
    "EQ30L8": "30 unknowns, 8 levels of 3",
    "EQ30L10": "30 unknowns, 10 levels of 3",
    "INEQ7": "an arm: limits, avoidance, position, cone, posture",
    "HUM38": "38 unknowns: limits, four tasks, posture",
    "DEGEN7": "INEQ7 with rows repeated, negated, zero, nearly parallel",
    "DYN60": "a humanoid with torque motors: dynamics, contacts, friction (fresh: extra `sim`)"}
_OTHERS = {
    "of-soth": "as soth is tested: ranks, rows of upper levels, all sides",
    "of-lexls": "as LexLS is tested: equalities that add a rank each",
    "of-daqp": "as DAQP is tested: a program whose acting rows are known"}
_EXAMPLES = {
    "of-pink": "examples of pink: limits, barriers, then each task a level",
    "of-mink": "examples of mink: limits, then each task a level",
    "of-placo": "examples of placo: limits, hard tasks, then each soft task a level",
    "of-tsid": "examples of tsid: dynamics, contacts and limits above the weighted tasks"}


FAMILIES = {name: Family(
    name, group, what, partial(make, name), group == "recorded",
    _FEW if name in _SIMULATED else _CONSECUTIVE if group == "recorded" else COUNT)
    for group, make, named in (
        ("reference", _reference, _REFERENCE), ("recorded", recorded.recorded, recorded.SCENARIOS),
        ("postures", made.posed, {name: one.what for name, one in made.ROBOTS.items()}),
        ("degenerate", _generated, TEXTS),
        ("others", _other, _OTHERS), ("others", made.of_examples, _EXAMPLES),
        ("random", _generated, {"recipe": "random sizes, ranks, ties, scales"}))
    for name, what in named.items()}
"""The families by name."""
_NEEDS = {**dict.fromkeys(("singular-panda", "singular-romeo"),
                          ("example-robot-data", "descriptions")),
          **dict.fromkeys(_SIMULATED, ("mujoco", "sim"))}
"""Distribution and extra of this project that a family needs."""


def available() -> list[Family]:
    """Return the families whose packages are installed."""
    left = unavailable()
    return [one for name, one in FAMILIES.items() if name not in left]


def unavailable() -> dict[str, str]:
    """Return what to install for each of the other families, by name."""
    # A wheel of example-robot-data has no module of Python.
    return {name: f"needs {package}: pip install 'task-hierarchy[{extra}]'"
            for name, (package, extra) in _NEEDS.items() if version_of(package) is None}


def answer(h: Hierarchy) -> Proof:
    """Return the proof that the answer of `hcod` leads to, or else the best of all candidates'."""
    found = prove(h, [make("hcod").solve(h).x])
    if found.complete:
        return found
    others = [make("hqp", backend=name) for name in filter(installed, _BACKENDS)]
    others += [make("recursive")] * h.is_equality
    return max(found, prove(h, (one.solve(h).x for one in others)), key=lambda one: one.judged)


def file_of(folder: Path, family: str, seed: int) -> Path:
    """Return the path of a set's file."""
    return folder / f"{family}-{f'fresh-{seed}' if seed else 'public'}.npz"


def export(family: Family, seed: int, count: int | None, answers: bool, folder: Path,
           progress: Progress | None = None) -> Path:
    """Write a set of a family into the folder, and return the file.

    answers : whether to prove those that can be. progress : told the number of problems done, and
        their number.
    """
    found, proofs = family.half(seed, count), []
    for done, h in enumerate(found.problems if answers else (), 1):
        proofs.append(answer(h))
        if progress is not None:
            progress(done, len(found.problems))
    return save(replace(found, answers=tuple(proofs)) if answers else found, folder)


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
    off = ~(abs(said.least - found.least)[:judged] <= _SAME * (1.0 + abs(found.least[:judged])))
    if off.any():
        k = int(np.argmax(off))
        return f"level {k + 1}: least violation {said.least[k]:.17g}, proved {found.least[k]:.17g}"
    off = ~(abs(said.x - found.x) <= _SAME * (1.0 + abs(found.x).max()))
    if judged > len(said.least) and off.any():
        i = int(np.argmax(abs(said.x - found.x)))
        return f"x[{i}] is {said.x[i]:.17g}, proved {found.x[i]:.17g}"
    return ""
