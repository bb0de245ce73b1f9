"""A resolver on a million generated problems, every answer certified.

The problems come from `solvers.problems`: the recipe ("recipe") and every structured kind by name.
Where `certify` refuses an answer that is called solved, the proof in 120 digits decides. A problem
fails if the resolver raises, returns a number that is not finite, calls solved what is proved wrong
or cannot be proved, or kills its process, or if an oracle raises. A failing problem is reduced
while it fails in the same way, and saved as a file that `solvers.problems.load` reads. With
NUMBA_BOUNDSCHECK=1 (and a separate NUMBA_CACHE_DIR) a kernel that accesses memory outside its
arrays raises instead of corrupting memory.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self, final

import numpy as np

from benchmark.report import Column, Report, Row, Section, Table, whole
from benchmark.solve.judge import RIGHT, miss_of
from hierarchy.errors import check_name
from hierarchy.problem import Array, Hierarchy
from scenarios.cli.terminal import bar
from scenarios.problems.families import answer
from scenarios.results.pool import ended
from solvers import Resolver, Status, certify, make, problems
from solvers.proof import prove

CERTIFIED, PROVED = "certified", "proved right"
RAISED, NOT_FINITE, WRONG = "raised", "not finite", "proved wrong"
UNDECIDED, UNJUDGED = "solved, neither certified nor proved", "solved, an oracle raised"
FAILURES = (RAISED, NOT_FINITE, WRONG, UNDECIDED, UNJUDGED)
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

    def add(self, other: Self) -> None:
        """Add the counts of another tally."""
        self.counts.update(other.counts)
        self.failing += other.failing
        self.lost += other.lost
        self.effort.update(other.effort)

    def row(self, kind: str) -> Row:
        """Return the row of a kind: counts, median and largest of iterations divided by rows."""
        every = np.repeat(np.array([*self.effort, 0]) / 100.0, [*self.effort.values(), 0])
        return {"kind": kind, "problems": self.counts.total(), **self.counts,
                "failed": len(self.failing), "lost": self.counts[CRASHED],
                "median": np.percentile(every, 50.0, method="lower") if every.size else 0.0,
                "most": every.max(initial=0.0)}


def outcome(resolver: Resolver, h: Hierarchy) -> tuple[str, int]:
    """Return the outcome of a solve (a constant of this module or a Status) and its iterations."""
    try:
        res = resolver.solve(h)
    except Exception:  # a solve must never raise
        return RAISED, 0
    if not np.isfinite(res.x).all():
        return NOT_FINITE, res.iterations
    if res.status is not Status.SOLVED:
        return res.status.name, res.iterations
    try:
        return CERTIFIED if certify(h, res.x).certified else _proved(h, res.x), res.iterations
    except Exception:  # an error of an oracle must not end the run
        return UNJUDGED, res.iterations


def _proved(h: Hierarchy, x: Array) -> str:
    """Return what the proof says of an answer: by itself, or else beside that of another."""
    proof = prove(h, [x])
    if not proof.complete:
        proof = max(proof, answer(h), key=lambda one: one.judged)
    if proof.judged and miss_of(h, proof, x).relative > RIGHT:
        return WRONG
    return PROVED if proof.complete else UNDECIDED


def problem(resolver: Resolver, kind: str, seed: int) -> Hierarchy:
    """Return the problem of a kind and a seed, restricted to what the resolver can handle.

    For a resolver of bounds, two of three problems have a box.
    """
    recipe = problems.Recipe(equalities_only=resolver.handles != "inequalities")
    h = (problems.generate(seed, recipe) if kind == RECIPE
         else problems.structured(seed, (kind,), recipe.equalities_only))
    inside = resolver.handles == "bounds" and resolver.strict and seed % 3 > 0
    return problems.bounded(h, seed) if inside else h


def tally(job: tuple[str, range, str]) -> Tally:
    """Judge a resolver, by name, on the problems of some seeds and a kind."""
    name, seeds, kind = job
    resolver, found = make(name), Tally()
    for seed in seeds:
        h = problem(resolver, kind, seed)
        what, iterations = outcome(resolver, h)
        found.counts[what] += 1
        found.effort[round(100 * iterations / max(1, h.m))] += 1
        if what in FAILURES:
            found.failing.append((seed, what))
    return found


def run(out: Path, count: int, resolver: str, kind: str, first: int, processes: int | None
        ) -> Report:
    """Judge a resolver on `count` problems starting at seed `first`; save what fails in `out`.

    kind : one of KINDS, or "all" to distribute the problems evenly over them.
    processes : number of processes; None for one per core.

    An interrupted run says what was judged. Raises UnknownNameError.
    """
    make(resolver)
    check_name("kind", kind, (ALL, *KINDS))
    kinds = KINDS if kind == ALL else (kind,)
    each = -(-count // len(kinds))
    found = {one: Tally() for one in kinds}
    jobs = [(resolver, range(i, min(i + _CHUNK, first + each)), one) for one in kinds
            for i in range(first, first + each, _CHUNK)]
    try:
        with bar("problems") as told:
            for (_, seeds, one), part in ended(tally, jobs, processes):
                found[one].add(part or Tally(Counter({CRASHED: len(seeds)}), lost=[seeds]))
                done = sum(some.counts.total() for some in found.values())
                told(resolver, done, each * len(kinds))
    except KeyboardInterrupt:
        report(resolver, found, out).say()
        raise
    return report(resolver, found, out)


def report(name: str, found: Mapping[str, Tally], out: Path) -> Report:
    """Return a table of the outcomes of each kind; the failing problems are saved, and listed."""
    total, lines = Tally(), list[str]()
    for kind, one in found.items():
        total.add(one)
        lines += [f"{kind}, seed {seed}, {what}: {keep(name, seed, what, out, kind)}"
                  for seed, what in sorted(one.failing)[:_KEPT]]
        lines += [f"{kind}, seeds {seeds.start} to {seeds.stop - 1}: {CRASHED}"
                  for seeds in sorted(one.lost, key=lambda seeds: seeds.start)[:_KEPT]]
    rows = [one.row(kind) for kind, one in {
        **found, **({ALL: total} if len(found) > 1 else {})}.items()]
    others = sorted(set(total.counts) - {CERTIFIED, CRASHED, RAISED, NOT_FINITE})
    columns = [*(Column(what.lower().replace("_", "\n").replace(" ", "\n"), what,
                        lambda n: whole(n or 0))
                 for what in ("problems", CERTIFIED, "failed", "lost", *others)),
               *(Column(f"steps\n/ row\n{key}", key) for key in ("median", "most"))]
    return Report(f"{name} on generated problems", [Section("", [Table(
        f"{name}: outcomes, each answer certified", rows, columns, "kind")], "\n".join(lines))],
        {"stress": rows}, failed=bool(total.failing or total.lost))


def keep(name: str, seed: int, what: str, out: Path, kind: str = RECIPE) -> Path:
    """Reduce the problem of a seed while its outcome is the same; save it and return the file."""
    resolver = make(name)
    smallest = shrunk(problem(resolver, kind, seed),
                      lambda smaller: outcome(resolver, smaller)[0] == what)
    out.mkdir(parents=True, exist_ok=True)
    file = out / (f"{name}-{seed}.npz" if kind == RECIPE else f"{name}-{kind}-{seed}.npz")
    problems.save(smallest, file)
    return file


def shrunk(h: Hierarchy, fails: Callable[[Hierarchy], bool]) -> Hierarchy:
    """Remove levels, rows, columns and the reference as long as `fails` holds."""
    candidates = _smaller(h)
    for _ in range(_TRIALS):
        smaller = next(candidates, None)
        if smaller is None:
            break
        if fails(smaller):
            h, candidates = smaller, _smaller(smaller)
    return h


def _smaller(h: Hierarchy) -> Iterator[Hierarchy]:
    """Yield the hierarchy without one of its parts, the largest parts first."""
    levels: list[tuple[Array, ...]] = list(h.levels())
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
