"""How many problems per second does a batch solve, on one core and on all cores?

Problems of a reference family, each with its own targets and reference, are solved by
`solvers.batch` with one thread and with one per core, by `resolver.solve` in a Python loop, and for
`tpm` by jax if installed. jax runs on the device that it finds; the numbers in docs/batch.md are
from a CPU.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from time import perf_counter, process_time
from typing import Any, final

import numpy as np

from benchmark.machine import machine
from benchmark.report import Report, Section
from benchmark.store import Row
from benchmark.tables import Column, Table
from hierarchy.problem import Hierarchy
from scenarios.problems.reference import family
from solvers import Resolver, make
from solvers.batch import Batch, cores, solve

COUNTS = (100, 1000, 10_000, 100_000)
ENTRIES = (("EQ7", "tpm"), ("EQ7", "hcod"), ("INEQ7", "hcod"))
_LOOPED = 1000  # problems solved one by one, at most
_NOTES = """\
Millions of problems per second: from the fastest call, and per core from the processor time of \
all calls. Both are insensitive to other load on the machine; medians are in the CSV."""


@final
@dataclass
class Timed:
    """One method to solve a batch: its call, and its times [s] on the wall and of the processor."""

    way: str
    call: Callable[[], Any]
    count: int
    wall: list[float] = field(default_factory=list)
    processor: list[float] = field(default_factory=list)

    def take_turn(self) -> None:
        """Call once, timed."""
        start, used = perf_counter(), process_time()
        self.call()
        self.processor.append(process_time() - used)
        self.wall.append(perf_counter() - start)

    def row(self) -> Row:
        """Return what is written down: rates in millions a second, times [us] of a problem."""
        best, median, p95 = np.percentile(self.wall, [0, 50, 95])
        per_core = self.count * len(self.processor) / sum(self.processor)
        return {"way": self.way, "calls": len(self.wall), "best_us": 1e6 * best / self.count,
                "median_us": 1e6 * median / self.count, "p95_us": 1e6 * p95 / self.count,
                "rate": 1e-6 * self.count / best, "per_core": 1e-6 * per_core}


def run(counts: Sequence[int] = COUNTS, seconds: float = 1.0,
        entries: Sequence[tuple[str, str]] = ENTRIES) -> Report:
    """Time every method on every family and batch size.

    seconds : [s] for all methods together at one batch size; at least three calls of each.
    entries : (family, resolver).

    Raises
    ------
    HierarchyError : an unknown family.
    """
    rows: list[Row] = []
    tables = []
    for name, resolver in entries:
        own = [{"family": name, "resolver": resolver, "problems": count, **row}
               for count in counts for row in _timed(name, make(resolver), count, seconds)]
        tables.append(_table(f"{name}, {resolver}", own))
        rows += own
    return Report(f"Batches on {cores()} cores of {machine()['processor']}",
                  [Section("", tables, _NOTES)], {"batch": rows})


def _table(title: str, rows: Sequence[Row]) -> Table:
    """Return a row for each batch size: the rate of each method, and its rate per core."""
    sizes: dict[int, dict[str, Any]] = {}
    for row in rows:
        own = sizes.setdefault(row["problems"], {"problems": f"{row['problems']:,}"})
        own |= {row["way"]: row["rate"], f"{row['way']} core": row["per_core"]}
    columns = [Column(head, key, "{:.3g}".format) for way in dict.fromkeys(
        row["way"] for row in rows) for head, key in ((way, way), ("per core", f"{way} core"))]
    return Table(title, list(sizes.values()), columns, "problems")


def problems_like(name: str, count: int, seed: int = 0) -> Batch:
    """Return `count` problems of a family, with targets varied by 1 % and random references."""
    r = np.random.default_rng(seed)
    originals = [problem.h for problem in family(name)]
    return Batch.of([_like(originals[p % len(originals)], r) for p in range(count)])


def _like(h: Hierarchy, r: np.random.Generator) -> Hierarchy:
    factor = 1.0 + 0.01 * r.uniform(-1.0, 1.0, h.m)
    return h.changed(lower=h.lower * factor, upper=h.upper * factor, reference=r.normal(size=h.n))


def _timed(name: str, resolver: Resolver, count: int, seconds: float) -> Iterable[Row]:
    ways = list(_ways(problems_like(name, count), resolver))
    for way in ways:
        way.call()
    end = perf_counter() + seconds
    while perf_counter() < end or len(ways[0].wall) < 3:
        for way in ways:
            way.take_turn()
    return [way.row() for way in ways]


def _ways(batch: Batch, resolver: Resolver) -> Iterable[Timed]:
    alone = [batch[p] for p in range(min(len(batch), _LOOPED))]
    yield Timed("one by one", lambda: [resolver.solve(h) for h in alone], len(alone))
    for threads in dict.fromkeys((1, cores())):
        yield Timed(f"{threads} thread" + "s" * (threads > 1), _call(batch, resolver, threads),
                    len(batch))
    if resolver.name == "tpm" and find_spec("jax") is not None:
        from solvers.batch import on_jax as batch_jax

        yield Timed("jax", lambda: batch_jax.solve(batch, resolver), len(batch))


def _call(batch: Batch, resolver: Resolver, threads: int) -> Callable[[], Any]:
    return lambda: solve(batch, resolver, threads)
