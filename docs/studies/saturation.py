"""How near do resolvers come to the exact answer inside joint limits, and in what time?

    python docs/studies/saturation.py

Every resolver that takes bounds, on generated stacks behind a first level of bounds: mild ones,
that few joints meet, and severe ones. The exact answer is that of `hcod`, kept only where `certify`
accepts it from the data alone.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter_ns
from typing import Any, final

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from hierarchy.problem import Array, Hierarchy
from scenarios.bench.candidates import moved
from scenarios.bench.machine import machine, one_core
from scenarios.bench.rows import table_of_numbers, write_rows
from solvers import Resolver, Status, certify, make, names
from solvers.problems import Recipe, written

SAME = 1e-6  # of |b_k|: a level that misses no more than that beyond the exact answer is optimal
_TIMES = 3   # solves of each problem that are timed; the fastest counts
_HARD = Recipe(equalities_only=True, near_parallel=0.0, scales=(1.0, 1.0), spread=1.0)

NOTES = f"""
L k: share of problems [%] in which levels 1 to k, the bounds not counted, miss no \
more than the exact answer, to {SAME:g} of their targets. near: share that is also \
nearest to the reference. extra k: what level k misses too much, median / 95th \
percentile, as a share of its target, where the levels above it are optimal. off: \
share that ended with a status. us: a solve from Python in microseconds, cold; warm: \
with the memory of the same problem with its targets and sides moved by up to 1 %."""


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


@final
@dataclass
class Tally:
    """What one resolver did on one family; lists have an entry a problem."""

    resolver: Resolver
    extra: list[Array] = field(default_factory=list)  # (L - 1,) beyond the exact, over |b_k|
    near: list[bool] = field(default_factory=list)
    at_bound: list[int] = field(default_factory=list)
    beyond: float = 0.0                               # largest distance beyond a bound
    off: int = 0
    cold: list[float] = field(default_factory=list)   # [us]
    warm: list[float] = field(default_factory=list)   # [us]

    def judge(self, h: Hierarchy, exact: Array) -> None:
        """Solve once, and compare with what each level of the exact answer misses."""
        res = self.resolver.solve(h)
        missed = h.violations(res.x)
        asked = np.array([np.linalg.norm(b) for _, b, _ in h.levels()][1:])
        extra = (missed - exact)[1:] / np.where(asked > 0.0, asked, 1.0)
        self.extra.append(extra)
        self.near.append(bool((extra <= SAME).all()) and certify(h, res.x, SAME).certified)
        lower, upper = h.lower[:h.n], h.upper[:h.n]
        self.at_bound.append(int(((res.x <= lower) | (res.x >= upper)).sum()))
        self.beyond = max(self.beyond, float(missed[0]))
        self.off += res.status is not Status.SOLVED

    def time(self, h: Hierarchy) -> None:
        """Solve from nothing, and with the memory of nearly the same problem."""
        memory = self.resolver.solve(moved(h)).memory
        self.cold.append(_fastest(self.resolver, h, None))
        self.warm.append(_fastest(self.resolver, h, memory))

    @property
    def optimal(self) -> NDArray[np.bool_]:
        """Whether level k and all above are optimal, (problems, L - 1)."""
        passed: NDArray[np.bool_] = np.logical_and.accumulate(np.array(self.extra) <= SAME, axis=1)
        return passed

    def row(self, family: Family) -> dict[str, Any]:
        """Return the numbers of the table by name."""
        optimal, extra = self.optimal, np.maximum(self.extra, 0.0)
        above = np.hstack([np.ones((len(extra), 1), dtype=bool), optimal[:, :-1]])
        found: dict[str, Any] = {"family": family.name, "resolver": self.resolver.label,
                                 "problems": len(extra)}
        for k in range(len(family.sizes)):
            some = extra[above[:, k], k]
            found |= {f"optimal_{k + 1}": float(optimal[:, k].mean()),
                      f"extra_{k + 1}_p50": float(np.median(some)) if some.size else None,
                      f"extra_{k + 1}_p95": float(np.percentile(some, 95)) if some.size else None}
        return found | {"nearest": float(np.mean(self.near)), "beyond": self.beyond,
                        "off": self.off / len(extra), "cold_us": float(np.median(self.cold)),
                        "cold_p95_us": float(np.percentile(self.cold, 95)),
                        "warm_us": float(np.median(self.warm))}


def resolvers() -> list[Resolver]:
    """Return every resolver that takes bounds, as it comes."""
    return [one for one in map(make, names()) if one.handles in ("bounds", "inequalities")]


def run(out: Path | None = None, count: int = 400, entrants: Sequence[Resolver] | None = None,
        families: Sequence[Family] = FAMILIES) -> list[dict[str, Any]]:
    """Judge and time the entrants on `count` stacks of each family; print a table each.

    Writes saturation.csv into `out` if given; returns the rows.
    """
    console, rows = Console(highlight=False), []
    console.print(f"Resolvers inside limits, one core of {machine()['processor']}")
    for family in families:
        with one_core():
            found, left_out = _run_family(family, count, entrants or resolvers())
        rows += [tally.row(family) for tally in found]
        _print_family(console, family, found, count, left_out)
    console.print(NOTES)
    if out is not None:
        write_rows(rows, out / "saturation.csv")
    return rows


def _run_family(family: Family, count: int,
                entrants: Sequence[Resolver]) -> tuple[list[Tally], int]:
    """Return what each did, and the number of problems without a certified answer."""
    exact, found, left_out = make("hcod"), [Tally(resolver) for resolver in entrants], 0
    for seed in range(count):
        h = family.problem(seed)
        x = exact.solve(h).x
        if not certify(h, x).certified:
            left_out += 1
            continue
        missed = h.violations(x)
        for tally in found:
            tally.judge(h, missed)
        for tally in found:
            tally.time(h)
    return found, left_out


def _fastest(resolver: Resolver, h: Hierarchy, memory: Any) -> float:
    best = np.inf
    for _ in range(_TIMES):
        start = perf_counter_ns()
        resolver.solve(h, memory)
        best = min(best, perf_counter_ns() - start)
    return best / 1e3


def _print_family(console: Console, family: Family, found: Sequence[Tally], count: int,
                  left_out: int) -> None:
    levels = range(1, len(family.sizes) + 1)
    table = table_of_numbers((*(f"L {k}" for k in levels), "near", *(f"extra {k}" for k in levels),
                              "off", "us", "p95", "warm"))
    for tally in found:
        row = tally.row(family)
        extra = (f"{_short(row[f'extra_{k}_p50'])}/{_short(row[f'extra_{k}_p95'])}" for k in levels)
        table.add_row(row["resolver"], *(_share(row[f"optimal_{k}"]) for k in levels),
                      _share(row["nearest"]), *extra, _share(row["off"]),
                      *(_digits(row[key]) for key in ("cold_us", "cold_p95_us", "warm_us")))
    at_bound = np.mean([tally.at_bound for tally in found if tally.resolver.name == "hcod"] or 0.0)
    beyond = max(tally.beyond for tally in found)
    console.print("", f"{family.name}: {count - left_out} problems, {at_bound:.1f} joints at a "
                  f"bound,\nat most {beyond:.0e} beyond", table, sep="\n")


def _share(value: float) -> str:
    """Return per cent; 100 only where nothing is missing."""
    return f"{100.0 * value:.0f}" if value in (0.0, 1.0) else f"{min(100.0 * value, 99.9):.1f}"


def _short(value: float | None) -> str:
    if value is None:
        return "–"
    return "0" if value <= SAME else f"{value:.1g}".removeprefix("0").replace("e-0", "e-")


def _digits(value: float) -> str:
    return f"{value:.0f}" if value >= 100.0 else f"{value:.3g}"


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(prog="python docs/studies/saturation.py",
                                     description="Resolvers inside joint limits.")
    parser.add_argument("--count", type=int, default=400, help="problems of a family")
    parser.add_argument("--resolver", action="append", help="a name; may be repeated")
    parser.add_argument("--out", type=Path, default=None, help="folder for saturation.csv")
    given = parser.parse_args()
    run(given.out, given.count, [make(name) for name in given.resolver or ()] or None)
    return 0


if __name__ == "__main__":
    sys.exit(main())
