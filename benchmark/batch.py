"""How many problems per second does a batch solve, on one core and on all cores?

Problems of a reference family, each with its own targets and reference, are solved by
`solvers.batch` with one thread and with one per core, by `resolver.solve` in a Python loop, and for
`tpm` by jax if installed. jax runs on the device that it finds; the numbers in docs/batch.md are
from a CPU.
"""

from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from itertools import cycle, islice
from time import perf_counter, process_time
from typing import Any

import numpy as np

from benchmark.report import Report, Row, Section, Table, wide
from benchmark.solve.interface import moved
from benchmark.timing import machine
from scenarios.problems.recorded import family
from solvers import Resolver, make
from solvers.batch import Batch, cores, solve

COUNTS = (100, 1000, 10_000, 100_000)
ENTRIES = (("EQ7", "tpm"), ("EQ7", "hcod"), ("INEQ7", "hcod"))
_LOOPED = 1000  # problems solved one by one, at most
_NOTES = """\
Millions of problems per second: from the fastest call, and per core from the processor time of \
all calls. Both are insensitive to other load on the machine; medians are in the CSV."""


def run(counts: Sequence[int] | None = None, seconds: float = 1.0) -> Report:
    """Time every method on every family and batch size, COUNTS by default.

    seconds : [s] for all methods together at one batch size; at least three calls of each.
    """
    rows, tables = list[Row](), []
    for name, resolver in ENTRIES:
        found = [{"family": name, "resolver": resolver, "problems": count, **row}
                 for count in counts or COUNTS
                 for row in _timed(problems_like(name, count), make(resolver), seconds)]
        tables.append(Table(f"{name}, {resolver}", *wide(
            [{**row, "problems": f"{row['problems']:,}"} for row in found], "problems", "way",
            {"fastest": "rate", "per core": "per_core"}, "{:.3g}".format), "problems"))
        rows += found
    return Report(f"Batches on {machine()['processor']}",
                  [Section("", tables, _NOTES)], {"batch": rows})


def problems_like(name: str, count: int) -> Batch:
    """Return `count` problems of a family, with targets varied by 1 % and random references."""
    r = np.random.default_rng(0)
    originals = [problem.h for problem in family(name)]
    return Batch.of([moved(h, r).changed(reference=r.normal(size=h.n))
                     for h in islice(cycle(originals), count)])


def _timed(batch: Batch, resolver: Resolver, seconds: float) -> list[Row]:
    """Return what is measured of each way, in turns: rates in millions a second, times [us]."""
    ways = _ways(batch, resolver)
    for call, _ in ways.values():
        call()
    spent: dict[str, list[tuple[float, float]]] = {way: [] for way in ways}
    end = perf_counter() + seconds
    while perf_counter() < end or len(next(iter(spent.values()))) < 3:
        for way, (call, _) in ways.items():
            start, used = perf_counter(), process_time()
            call()
            used, passed = process_time() - used, perf_counter() - start
            spent[way].append((passed, used))
    rows = []
    for way, (_, count) in ways.items():
        wall, processor = np.array(spent[way]).T
        best, median, p95 = np.percentile(wall, [0, 50, 95])
        rows.append({"way": way, "calls": len(wall), "best_us": 1e6 * best / count,
                     "median_us": 1e6 * median / count, "p95_us": 1e6 * p95 / count,
                     "rate": 1e-6 * count / best,
                     "per_core": 1e-6 * count * len(wall) / processor.sum()})
    return rows


def _ways(batch: Batch, resolver: Resolver) -> dict[str, tuple[Callable[[], Any], int]]:
    """Return a call for each way, and how many problems it solves."""
    alone = [batch[p] for p in range(min(len(batch), _LOOPED))]
    found: dict[str, tuple[Callable[[], Any], int]] = {
        "one by one": (lambda: [resolver.solve(h) for h in alone], len(alone))}
    for threads in dict.fromkeys((1, cores())):
        found[f"{threads} thread" + "s" * (threads > 1)] = (
            partial(solve, batch, resolver, threads), len(batch))
    if resolver.name == "tpm" and find_spec("jax") is not None:
        from solvers.batch import on_jax

        found["jax"] = (lambda: on_jax.solve(batch, resolver), len(batch))
    return found
