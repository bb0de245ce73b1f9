"""A resolver on a million generated problems, every answer certified.

The problems come from `solvers.problems`: the recipe ("recipe") and every structured kind by name.
A problem fails if the resolver raises, returns a number that is not finite, reports as solved what
`certify` rejects, or kills its process, or if `certify` raises. A failing problem is reduced while
it still fails in the same way, and saved as a file that `solvers.problems.load` reads. With
NUMBA_BOUNDSCHECK=1 (and a separate NUMBA_CACHE_DIR) a kernel that accesses memory outside its
arrays raises instead of corrupting memory.
"""

from __future__ import annotations

import multiprocessing
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import final

import numpy as np
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from benchmark.report import Report, Section
from benchmark.tables import Column, Table, whole
from hierarchy.problem import Hierarchy
from solvers import Resolver, Status, certify, make, problems

CERTIFIED = "certified"
RAISED, NOT_FINITE, WRONG = "raised", "not finite", "solved, not certified"
UNJUDGED = "solved, the certificate raised"
FAILURES = (RAISED, NOT_FINITE, WRONG, UNJUDGED)
CRASHED = "not judged, a process died"
_CHUNK = 500  # seeds per task of a process
_KEPT = 20    # failing problems reduced and saved, at most
_TRIALS = 3000  # per reduction
RECIPE, ALL = "recipe", "all"
KINDS = (RECIPE, *problems.KINDS)


@final
@dataclass
class Tally:
    """Counts of outcomes, the seeds of failures, and the seeds not judged.

    effort : histogram of iterations divided by rows, in hundredths.
    """

    counts: Counter[str] = field(default_factory=Counter)
    failing: list[tuple[int, str]] = field(default_factory=list)
    lost: list[range] = field(default_factory=list)
    effort: Counter[int] = field(default_factory=Counter)

    @property
    def passed(self) -> bool:
        """Whether all problems were judged and none failed."""
        return not self.failing and not self.lost

    def add(self, other: Tally) -> None:
        """Add the counts of another tally."""
        self.counts.update(other.counts)
        self.failing += other.failing
        self.lost += other.lost
        self.effort.update(other.effort)

    def iterations_per_row(self) -> tuple[float, float, float]:
        """Median, 99.9th percentile and largest of iterations divided by rows; zeros if none."""
        every = np.repeat(np.array([*self.effort]) / 100.0, [*self.effort.values()])
        if not every.size:
            return 0.0, 0.0, 0.0
        median, rare, most = np.percentile(every, (50.0, 99.9, 100.0), method="lower")
        return float(median), float(rare), float(most)


def outcome(resolver: Resolver, h: Hierarchy) -> str:
    """Return the outcome of a solve: certified, one of FAILURES, or the name of another Status."""
    return _solved(resolver, h)[0]


def _solved(resolver: Resolver, h: Hierarchy) -> tuple[str, int]:
    """Return the outcome of a solve and its iterations, zero if it raised."""
    try:
        res = resolver.solve(h)
    except Exception:  # a solve must never raise
        return RAISED, 0
    if not np.isfinite(res.x).all():
        return NOT_FINITE, res.iterations
    if res.status is not Status.SOLVED:
        return res.status.name, res.iterations
    try:
        return CERTIFIED if certify(h, res.x).certified else WRONG, res.iterations
    except Exception:  # an error of the certificate must not end the run
        return UNJUDGED, res.iterations


def recipe_for(resolver: Resolver) -> problems.Recipe:
    """Return a recipe for problems that the resolver can handle."""
    return problems.Recipe(equalities_only=resolver.handles != "inequalities")


def problem(resolver: Resolver, kind: str, seed: int) -> Hierarchy:
    """Return the problem of a kind and a seed, restricted to what the resolver can handle.

    For a resolver of bounds, two of three problems have a box.
    """
    recipe = recipe_for(resolver)
    if kind == RECIPE:
        h = problems.generate(seed, recipe)
    else:
        h = problems.structured(seed, (kind,), recipe.equalities_only)
    inside = resolver.handles == "bounds" and resolver.strict and seed % 3 > 0
    return problems.bounded(h, seed) if inside else h


def tally(name: str, seeds: range, kind: str = RECIPE) -> Tally:
    """Judge the resolver called `name` on the problems of these seeds."""
    resolver, found = make(name), Tally()
    for seed in seeds:
        h = problem(resolver, kind, seed)
        what, iterations = _solved(resolver, h)
        found.counts[what] += 1
        found.effort[round(100 * iterations / max(1, h.m))] += 1
        if what in FAILURES:
            found.failing.append((seed, what))
    return found


def shrunk(h: Hierarchy, fails: Callable[[Hierarchy], bool]) -> Hierarchy:
    """Remove levels, rows, columns and the reference as long as `fails` holds."""
    left, changed = _TRIALS, True
    while changed and left:
        changed = False
        for smaller in _smaller(h):
            left -= 1
            if fails(smaller):
                h, changed = smaller, True
                break
            if not left:
                break
    return h


def _smaller(h: Hierarchy) -> Iterator[Hierarchy]:
    """Yield the hierarchy without one of its parts, the largest parts first."""
    levels = [tuple(part.copy() for part in level) for level in h.levels()]
    for k in range(len(levels)):
        yield Hierarchy.from_levels(levels[:k] + levels[k + 1:], h.reference)
    for k, level in enumerate(levels):
        for row in range(len(level[0])):
            fewer = tuple(np.delete(part, row, axis=0) for part in level)
            yield Hierarchy.from_levels([*levels[:k], fewer, *levels[k + 1:]], h.reference)
    for column in range(h.n if h.n > 1 else 0):
        yield Hierarchy.from_levels(
            [(np.delete(A, column, axis=1), lower, upper) for A, lower, upper in levels],
            np.delete(h.reference, column))
    if h.reference.any():
        yield Hierarchy.from_levels(levels, np.zeros(h.n))


def run(count: int, name: str, first: int = 0, processes: int | None = None, kind: str = RECIPE
        ) -> dict[str, Tally]:
    """Judge a resolver on `count` problems starting at seed `first`; return the counts by kind.

    processes : number of processes; None for one per core.
    kind : one of KINDS, or "all" to distribute the problems evenly over them.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read by the processes when they start
    kinds = KINDS if kind == ALL else (kind,)
    each = -(-count // len(kinds))
    found = {one: Tally() for one in kinds}
    columns = (TextColumn(name), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
               TextColumn("failed: {task.fields[failed]}"))
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(processes, context) as pool, Progress(*columns) as bar:
        task = bar.add_task(name, total=each * len(kinds), failed=0)
        parts = {pool.submit(tally, name, chunk, one): (one, chunk) for one in kinds
                 for chunk in _chunks(first, each)}
        for part in as_completed(parts):
            one, chunk = parts[part]
            found[one].add(_judged(part, chunk))
            bar.update(task, completed=sum(some.counts.total() for some in found.values()),
                       failed=sum(len(some.failing) for some in found.values()))
    return found


def report(name: str, found: Mapping[str, Tally], out: Path) -> Report:
    """Return a table of the outcomes of each kind; the failing problems are saved, and listed."""
    whole_, lines = Tally(), list[str]()
    for kind, one in found.items():
        whole_.add(one)
        lines += [f"{kind}, seed {seed}, {what}: {keep(name, seed, what, out, kind)}"
                  for seed, what in sorted(one.failing)[:_KEPT]]
        lines += [f"{kind}, seeds {chunk.start} to {chunk.stop - 1}: {CRASHED}"
                  for chunk in sorted(one.lost, key=lambda seeds: seeds.start)[:_KEPT]]
    every = {**found, **({ALL: whole_} if len(found) > 1 else {})}
    rows = [{"kind": kind, "problems": one.counts.total(), **one.counts,
             "failed": len(one.failing), "lost": one.counts[CRASHED],
             **dict(zip(("median", "p99.9", "most"), one.iterations_per_row(), strict=True))}
            for kind, one in every.items()]
    others = sorted(set(whole_.counts) - {CERTIFIED, CRASHED, *FAILURES})  # other than solved
    columns = [*(Column(key, key, whole) for key in ("problems", CERTIFIED, "failed", "lost")),
               *(Column(what.lower().replace("_", "\n"), what, lambda n: whole(n or 0))
                 for what in others),
               *(Column(f"steps / row\n{key}", key) for key in ("median", "most"))]
    return Report(f"{name} on generated problems", [Section("", [Table(
        f"{name}: outcomes, each answer certified", rows, columns, "kind")], "\n".join(lines))],
        {"stress": rows}, failed=not whole_.passed)


def _chunks(first: int, count: int) -> list[range]:
    return [range(i, min(i + _CHUNK, first + count)) for i in range(first, first + count, _CHUNK)]


def _judged(part: Future[Tally], seeds: range) -> Tally:
    """Return the tally of these seeds, or mark them as lost if their process died."""
    try:
        return part.result()
    except BrokenProcessPool:
        return Tally(Counter({CRASHED: len(seeds)}), lost=[seeds])


def keep(name: str, seed: int, what: str, out: Path, kind: str = RECIPE) -> Path:
    """Reduce the problem of a seed while its outcome is the same; save it and return the file."""
    resolver = make(name)
    smallest = shrunk(problem(resolver, kind, seed),
                      lambda smaller: outcome(resolver, smaller) == what)
    out.mkdir(parents=True, exist_ok=True)
    file = out / (f"{name}-{seed}.npz" if kind == RECIPE else f"{name}-{kind}-{seed}.npz")
    problems.save(smallest, file)
    return file
