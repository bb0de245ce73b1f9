"""How near do resolvers come to the exact answer inside joint limits, and in what time?

    python -m benchmark.studies.saturation

Every resolver that takes bounds, on generated stacks behind a first level of bounds: mild ones,
that few joints meet, and severe ones. The exact answer is that of `hcod`, used only where `certify`
accepts it from the data alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, final

import numpy as np
import typer

from benchmark.machine import machine, one_core
from benchmark.report import Report, Section
from benchmark.solve.resolvers import as_problem
from benchmark.store import Row
from benchmark.tables import Column, Table, digits, percent
from benchmark.timing import times_of
from benchmark.worker import Repeats, timed
from hierarchy.problem import Array, Hierarchy
from solvers import Resolver, Status, certify, make, names
from solvers.problems import Recipe, written

SAME = 1e-6  # of |b_k|: a level that misses no more than that beyond the exact answer is optimal
_TIMES = Repeats(3, 3)  # solves of each problem that are timed; the fastest counts
_HARD = Recipe(equalities_only=True, near_parallel=0.0, scales=(1.0, 1.0), spread=1.0)

NOTES = f"""\
L k: share of problems in which levels 1 to k, the bounds not counted, miss no more than the \
exact answer, to {SAME:g} of their targets. near: share that is also nearest to the reference. \
extra k: what level k misses too much, median / 95th percentile, as a share of its target, where \
the levels above it are optimal. off: share that ended with a status. us: a solve from Python in \
microseconds, cold; warm: with the memory of the same problem with its targets and sides moved by \
up to 1 %."""


@final
@dataclass(frozen=True)
class Family:
    """Stacks made at random.

    joints, sizes : unknowns, and rows of the levels behind the bounds.
    room : half the width of the bounds at most, as a share of the largest |x| without bounds.
    hard : levels that lose rank, are linked or conflict, as `solvers.problems` makes them.
    """

    name: str
    joints: int
    sizes: tuple[int, ...]
    room: float
    hard: bool = False

    def problem(self, seed: int) -> Hierarchy:
        """Return the stack of a seed."""
        rng = np.random.default_rng(seed)
        if self.hard:
            free = written(rng, self.joints, self.sizes, _HARD)
        else:
            free = Hierarchy.from_levels(
                [(rng.normal(size=(m, self.joints)), rng.normal(size=m)) for m in self.sizes])
        largest = np.abs(make("tpm").solve(free).x).max()
        half = self.room * largest * rng.uniform(0.3, 1.0, (2, self.joints))
        reference = 0.1 * self.room * largest * rng.normal(size=self.joints)
        levels = [(A, b) for A, b, _ in free.levels()]
        return Hierarchy.from_levels([(np.eye(self.joints), -half[0], half[1]), *levels], reference)


FAMILIES = tuple(
    Family(f"{joints} joints, {'+'.join(map(str, sizes))} {what}", joints, sizes, room, hard)
    for joints, sizes, hard in ((7, (3, 1, 1), False), (7, (3, 3, 3), False), (7, (3, 3), True),
                                (30, (6, 6, 6), False))
    for what, room in (("hard, mild" if hard else "mild", 1.8),
                       ("hard, severe" if hard else "severe", 0.4)))


def resolvers() -> list[Resolver]:
    """Return every resolver that takes bounds, as it comes."""
    return [one for one in map(make, names()) if one.handles in ("bounds", "inequalities")]


def run(count: int = 400, entrants: Sequence[Resolver] | None = None,
        families: Sequence[Family] = FAMILIES) -> Report:
    """Judge and time the entrants on `count` stacks of each family."""
    rows: list[Row] = []
    tables = []
    for family in families:
        with one_core():
            asked = _certified(family, count)
            found = [_row(family, resolver, asked) for resolver in entrants or resolvers()]
        bound = np.mean([row["at_bound"] for row in found if row["entrant"] == "hcod"] or 0.0)
        beyond = max(row["beyond"] for row in found)
        levels = range(1, len(family.sizes) + 1)
        tables.append(Table(
            f"{family.name}: {len(asked)} problems, {bound:.1f} joints at a bound,\nat most "
            f"{beyond:.0e} beyond", found, [
                *(Column(f"L {k}", f"optimal_{k}", percent) for k in levels),
                Column("near", "nearest", percent),
                *(Column(f"extra {k}", f"extra_{k}", str) for k in levels),
                Column("off", "off", percent), Column("us", "median_us", digits),
                Column("p95", "p95_us", digits), Column("warm", "warm_median_us", digits)]))
        rows += found
    title = f"Resolvers inside limits, one core of {machine()['processor']}"
    return Report(title, [Section("", tables, NOTES)], {"saturation": rows})


def _certified(family: Family, count: int) -> list[tuple[Hierarchy, Array]]:
    """Return the problems with a certified answer, and what each level misses at it."""
    exact, found = make("hcod"), []
    for h in map(family.problem, range(count)):
        x = exact.solve(h).x
        if certify(h, x).certified:
            found.append((h, h.violations(x)))
    return found


def _row(family: Family, resolver: Resolver, asked: Sequence[tuple[Hierarchy, Array]]) -> Row:
    extra, near, at_bound, beyond, off = [], [], [], [0.0], 0
    cold, warm = list[int](), list[int]()
    for h, exact in asked:
        res = resolver.solve(h)
        missed = h.violations(res.x)
        wanted = np.array([np.linalg.norm(b) for _, b, _ in h.levels()][1:])
        extra.append((missed - exact)[1:] / np.where(wanted > 0.0, wanted, 1.0))
        near.append(bool((extra[-1] <= SAME).all()) and certify(h, res.x, SAME).certified)
        at_bound.append(int(((res.x <= h.lower[:h.n]) | (res.x >= h.upper[:h.n])).sum()))
        beyond.append(float(missed[0]))
        off += res.status is not Status.SOLVED
        moved = as_problem(h).moved(0)
        memory = resolver.solve(h.changed(lower=moved.lower, upper=moved.upper)).memory
        cold.append(min(timed(partial(resolver.solve, h), _TIMES)))
        warm.append(min(timed(partial(resolver.solve, h, memory), _TIMES)))
    optimal = np.logical_and.accumulate(np.array(extra) <= SAME, axis=1)
    above = np.hstack([np.ones((len(extra), 1), dtype=bool), optimal[:, :-1]])
    levels: dict[str, Any] = {}
    for k in range(len(family.sizes)):
        some = np.maximum(extra, 0.0)[above[:, k], k]
        median, p95 = np.percentile(some, [50, 95]) if some.size else (np.nan, np.nan)
        levels |= {f"optimal_{k + 1}": float(optimal[:, k].mean()),
                   f"extra_{k + 1}": f"{_short(median)}/{_short(p95)}"}
    return {"family": family.name, "entrant": resolver.label, "problems": len(asked), **levels,
            "nearest": float(np.mean(near)), "at_bound": float(np.mean(at_bound)),
            "beyond": max(beyond), "off": off / len(asked), **times_of(cold),
            **times_of(warm, "warm_")}


def _short(value: float) -> str:
    if np.isnan(value):
        return "–"
    return "0" if value <= SAME else f"{value:.1g}".removeprefix("0").replace("e-0", "e-")


def main(count: int = 400, resolver: list[str] | None = None) -> None:
    """Print the tables; count : problems of a family; resolver : only this, may be repeated."""
    run(count, [make(name) for name in resolver or ()] or None).say()


if __name__ == "__main__":
    typer.run(main)
