"""The results of a benchmark's folder: judged rows of each half, never of both together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import final

import numpy as np

from hierarchy.errors import HierarchyError
from scenarios.bench.open.judge import Judged, judge
from scenarios.bench.open.run import LIMITS, MACHINE, MISSING, read_json
from scenarios.bench.open.store import Store
from scenarios.bench.open.summary import Summary, by, summary
from scenarios.bench.open.table import ENTRANTS
from solvers.problems.files import FRESH, Collection, read


@final
@dataclass(frozen=True)
class Half:
    """The judged rows of one half.

    Attributes
    ----------
    title : such as "Fresh problems, seed 1".
    rows : of all entrants and families.
    collections : the problems, by family.
    """

    title: str
    rows: tuple[Judged, ...]
    collections: dict[str, Collection]

    @cached_property
    def entrants(self) -> list[str]:
        """Labels in the order of the table; others after them."""
        found = dict.fromkeys(row.entrant for row in self.rows)
        known = [row.label for row in ENTRANTS if row.label in found]
        return known + [label for label in found if label not in known]

    @cached_property
    def families(self) -> list[str]:
        """Families in which an entrant has run, in the order of the benchmark."""
        found = {row.family for row in self.rows}
        return [name for name in self.collections if name in found]

    @cached_property
    def whole(self) -> dict[str, Summary]:
        """Each entrant over all families."""
        return {name: summary(own, self._steps) for name, own in by(self.rows, _entrant)}

    @cached_property
    def cells(self) -> dict[tuple[str, str], Summary]:
        """Each entrant in each family."""
        return {(name, family): summary(rows, self._steps)
                for name, own in by(self.rows, _entrant) for family, rows in by(own, _family)}

    @cached_property
    def _steps(self) -> dict[str, float]:
        """The largest step of the proved answers along each sequence."""
        found = {}
        for name, one in self.collections.items():
            answers = one.answers or ()
            steps = [float(np.linalg.norm(a.x - b.x))
                     for a, b in pairwise(answers)
                     if a.complete and b.complete and len(a.x) == len(b.x)]
            if one.head.sequence and steps:
                found[name] = max(steps)
        return found


@final
@dataclass(frozen=True)
class Results:
    """All halves of a folder, fresh ones first; why entrants are missing; the machine.

    limits : what is known of each entrant's limits, by label.
    """

    halves: tuple[Half, ...]
    missing: dict[str, str]
    machine: dict[str, str]
    limits: dict[str, str]

    def version(self, label: str) -> str:
        """Return the version of an entrant's package."""
        return next(row.version for half in self.halves for row in half.rows
                    if row.entrant == label)


def results(folder: Path) -> Results:
    """Read and judge a benchmark's folder; raises HierarchyError if it has no rows."""
    store = Store(folder)
    collections = [read(file) for file in sorted(store.problems.glob("[!.]*.npz"))]
    rows = judge(store.rows(), {one.digest: one for one in collections})
    if not rows:
        raise HierarchyError(f"{folder} has no rows of a benchmark: run `hierarchy bench open` "
                             "first")
    names = list(dict.fromkeys(name for name in _order()))
    seeds = sorted({row.seed for row in rows}, key=lambda seed: (seed == 0, seed))
    halves = tuple(Half(
        f"Fresh problems, seed {seed}" if seed else "Public problems",
        tuple(row for row in rows if row.seed == seed),
        {one.head.family: one
         for one in sorted(collections, key=lambda one: names.index(one.head.family)
                           if one.head.family in names else len(names))
         if one.head.seed == seed and one.head.half == (FRESH if seed else "public")})
        for seed in seeds)
    return Results(halves, *(read_json(folder / name) for name in (MISSING, MACHINE, LIMITS)))


def _order() -> list[str]:
    from scenarios.bench.open.families import FAMILIES

    return list(FAMILIES)


def _entrant(row: Judged) -> str:
    return row.entrant


def _family(row: Judged) -> str:
    return row.family
