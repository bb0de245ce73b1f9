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
from pathlib import Path
from time import perf_counter, process_time
from typing import Any, final

import numpy as np
from rich.console import Console
from rich.table import Table

from hierarchy.problem import Hierarchy
from scenarios.bench.families import family
from scenarios.bench.machine import machine
from scenarios.bench.rows import write_rows
from solvers import Resolver, make
from solvers.batch import Batch, cores, solve

COUNTS = (100, 1000, 10_000, 100_000)
ENTRIES = (("EQ7", "tpm"), ("EQ7", "hcod"), ("INEQ7", "hcod"))
_LOOPED = 1000  # problems solved one by one, at most

NOTES = """\
Millions of problems per second: from the fastest call, and per core from the processor time of \
all calls. Both are insensitive to other load on the machine; medians are in the CSV."""


@final
@dataclass
class Timed:
    """One method to solve a batch: its call and its times [s]."""

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

    def row(self, name: str, resolver: str, problems: int) -> dict[str, Any]:
        """Return the row of the table."""
        best, median, p95 = np.percentile(self.wall, [0, 50, 95])
        return {"family": name, "resolver": resolver, "problems": problems, "way": self.way,
                "calls": len(self.wall), "best_us": 1e6 * best / self.count,
                "median_us": 1e6 * median / self.count, "p95_us": 1e6 * p95 / self.count,
                "per_second": self.count / best,
                "per_second_and_core": self.count * len(self.processor) / sum(self.processor)}


def run(out: Path | None = None, counts: Sequence[int] = COUNTS, seconds: float = 1.0,
        entries: Sequence[tuple[str, str]] = ENTRIES) -> list[dict[str, Any]]:
    """Time every method on every family and batch size; print, write and return the rows.

    seconds : [s] for all methods together at one batch size; at least three calls of each.
    entries : (family, resolver).

    Raises
    ------
    HierarchyError : an unknown family.
    """
    console = Console(highlight=False, markup=False)
    console.print(f"Batches on {cores()} cores of {machine()['processor']}")
    rows: list[dict[str, Any]] = []
    for name, resolver in entries:
        some = [row for count in counts for row in _timed(name, make(resolver), count, seconds)]
        _print(console, f"{name}, {resolver}", some)
        rows += some
    console.print(NOTES)
    if out is not None:
        _write(rows, out)
    return rows


def problems_like(name: str, count: int, seed: int = 0) -> Batch:
    """Return `count` problems of a family, with targets varied by 1 % and random references."""
    r = np.random.default_rng(seed)
    originals = [problem.h for problem in family(name)]
    return Batch.of([_like(originals[p % len(originals)], r) for p in range(count)])


def _like(h: Hierarchy, r: np.random.Generator) -> Hierarchy:
    factor = 1.0 + 0.01 * r.uniform(-1.0, 1.0, h.m)
    return h.changed(lower=h.lower * factor, upper=h.upper * factor, reference=r.normal(size=h.n))


def _timed(name: str, resolver: Resolver, count: int, seconds: float) -> Iterable[dict[str, Any]]:
    ways = list(_ways(problems_like(name, count), resolver))
    for way in ways:
        way.call()
    end = perf_counter() + seconds
    while perf_counter() < end or len(ways[0].wall) < 3:
        for way in ways:
            way.take_turn()
    return [way.row(name, resolver.name, count) for way in ways]


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


def _print(console: Console, title: str, rows: Sequence[dict[str, Any]]) -> None:
    """Print the rate of each method and its rate per core, one row per batch size."""
    ways = list(dict.fromkeys(row["way"] for row in rows))
    table = Table(title=title, box=None, title_justify="left", pad_edge=False)
    for head in ("problems", *(head for way in ways for head in (way, "per core"))):
        table.add_column(head, justify="right")
    for count in dict.fromkeys(row["problems"] for row in rows):
        found = {row["way"]: row for row in rows if row["problems"] == count}
        rates = [found[way][rate] for way in ways for rate in ("per_second", "per_second_and_core")]
        table.add_row(f"{count:,}", *(f"{rate / 1e6:.3g}" for rate in rates))
    console.print(table)


def _write(rows: Sequence[dict[str, Any]], out: Path) -> None:
    write_rows(rows, out / "batch.csv")
