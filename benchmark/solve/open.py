"""The open benchmark: every solver on every family, public and fresh; continued if interrupted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, final

from benchmark.machine import machine
from benchmark.packages import Entrant, MissingError
from benchmark.process import CRASHED, HUNG, START_LIMIT, EndedError, Process, staged
from benchmark.report import Report
from benchmark.solve import views
from benchmark.solve.entrants import ENTRANTS, QUESTIONS
from benchmark.solve.judge import RAISED, SOLVED, WRONG, judge
from benchmark.solve.summary import cells, steps_of, summaries, summary
from benchmark.store import Row, Store
from hierarchy.errors import HierarchyError
from scenarios.problems.answers import export, file_of
from scenarios.problems.families import FAMILIES, Family
from solvers.problems.files import Collection, read

LIMIT = 10.0     # [s] for one problem with all its repetitions
MOST_ENDS = 5    # crashes and hangs of an entrant on a file, after which the rest is left out
LEFT_OUT = "left out after crashes"
CHECKED = ("EQ7", "EQ7sing", "INEQ7", "tied_box", "contacts", "mixed_units", "one_unknown")
_CHECKS, _CHECK_LIMIT = 4, 2.0  # problems of each of them; [s] for each problem
_MACHINE, _MISSING, _LIMITS = "machine", "missing", "limits"

Told = Callable[[str], None]


def run(folder: Path, families: Sequence[Family], entrants: Sequence[Entrant],
        counts: Mapping[int, int | None], limit: float = LIMIT, told: Told = print) -> Store:
    """Write the problems, run every entrant on them, and keep the raw rows.

    What is in the folder already stays as it is: an interrupted benchmark goes on, and an entrant
    that is added later meets the same problems.

    counts : problems of each half, by its seed, None for the usual number; 0 is the public half.
    limit : [s] for one problem. told : gets a line of text now and then.
    """
    store = Store(folder)
    missing, limits = store.notes(_MISSING), store.notes(_LIMITS)
    files = _problems(store, families, counts, told)
    store.note(_MACHINE, machine())
    for one in entrants:
        told(one.label)
        limits[one.label] = one.limits
        missing.pop(one.label, None)
        try:
            _add(store, one, files, limit)
        except MissingError as reason:
            missing[one.label] = str(reason)
        store.note(_LIMITS, limits)
        store.note(_MISSING, missing)
    return store


def _problems(store: Store, families: Sequence[Family], counts: Mapping[int, int | None],
              told: Told) -> list[Path]:
    files = []
    for family in families:
        for seed, count in counts.items():
            file = file_of(store.problems, family.name, seed)
            if not file.is_file():
                told(f"{family.name}, seed {seed}: problems and their proofs")
                export(family, seed, count, True, store.problems)
            files.append(file)
    return files


def _add(store: Store, entrant: Entrant, files: Sequence[Path], limit: float) -> None:
    """Run an entrant on the files on which it has not run yet."""
    left = [file for file in files if not store.file_of(entrant.label, file).is_file()]
    for file, rows in zip(left, asked(entrant, left, limit) if left else (), strict=True):
        store.add(rows, store.file_of(entrant.label, file))


def asked(entrant: Entrant, files: Sequence[Path], limit: float = LIMIT) -> Iterator[list[Row]]:
    """Yield the raw rows of an entrant on each file; raises MissingError if it cannot start."""
    with staged() as folder:
        process = Process(entrant, QUESTIONS, folder)
        try:
            for file in files:
                one = read(file)
                same = {"entrant": entrant.label, "version": process.about["version"],
                        "family": one.head.family, "half": one.head.half, "seed": one.head.seed,
                        "sha256": one.digest}
                rows = _answers(process, file, len(one.problems), limit)
                yield [{**same, **row} for row in rows]
        finally:
            process.stop()


def _answers(process: Process, file: Path, count: int, limit: float) -> list[Row]:
    """Ask for all problems of a file; an end costs one of them, and the next has a new process."""
    process.ends, ready, rows = 0, None, list[Row]()
    for p in range(count):
        if process.ends >= MOST_ENDS:
            rows.append({"problem": p, "ended": LEFT_OUT})
            continue
        try:
            if ready is None:
                patience = 2.0 * limit if process.ends else START_LIMIT
                ready = process.ask(("open", str(file.resolve()), p), patience)
            rows.append({"problem": p, **ready, **process.ask(("problem", p), limit)})
        except EndedError as end:
            rows.append({"problem": p, "ended": end.kind, "why": str(end)})
            ready = None
    return rows


@final
@dataclass(frozen=True)
class Half:
    """The judged rows of one half, never of both together; its problems, by family."""

    title: str
    rows: Sequence[Row]
    collections: Mapping[str, Collection]

    @cached_property
    def whole(self) -> list[Row]:
        """The summary of each entrant over all families."""
        return summaries(self.rows, steps_of(self.collections))

    @cached_property
    def cells(self) -> list[Row]:
        """The summary of each entrant in each family."""
        return cells(self.rows, steps_of(self.collections))


def halves(store: Store) -> list[Half]:
    """Judge what a folder has, fresh halves first; raises HierarchyError if it has no rows."""
    found = [read(file) for file in sorted(store.problems.glob("[!.]*.npz"))]
    rows = judge(store.rows(), {one.digest: one for one in found})
    if not rows:
        raise HierarchyError(f"{store.folder} has no rows of a benchmark: run `hierarchy bench "
                             "open` first")
    order, labels = [*FAMILIES], [one.label for one in ENTRANTS]
    rows.sort(key=lambda row: (_place(order, row["family"]), _place(labels, row["entrant"])))
    return [Half(f"Fresh problems, seed {seed}" if seed else "Public problems",
                 [row for row in rows if row["seed"] == seed],
                 {one.head.family: one for one in found if one.head.seed == seed})
            for seed in sorted({row["seed"] for row in rows}, key=lambda seed: (seed == 0, seed))]


def _place(order: Sequence[str], name: str) -> int:
    return order.index(name) if name in order else len(order)


def report(store: Store, width: int = 80) -> Report:
    """Return what a folder has, judged anew."""
    found = halves(store)
    limits, labels = store.notes(_LIMITS), {
        row["entrant"]: row["version"] for half in found for row in half.rows}
    sections = [views.section(half.title, half.rows, half.whole, half.cells, width)
                for half in found]
    known = views.entrants(labels, limits)
    rows: dict[str, list[Row]] = {"summary": [
        {"half": half.title, **row} for half in found for row in half.cells]}
    return Report("The open benchmark of prioritized control", [*sections, known], rows,
                  store.notes(_MISSING))


def check(entrant: Entrant, folder: Path) -> tuple[str, bool]:
    """Try an entrant on a few problems of each kind; return what came of it, and if it is well.

    It must run, answer something, never end early, and give the same bits twice.
    """
    files = [export(FAMILIES[name], 0, _CHECKS, True, folder) for name in CHECKED]
    try:
        every = list(asked(entrant, files, _CHECK_LIMIT))
    except MissingError as reason:
        return f"{entrant.label}: cannot run: {reason}", False
    found = {one.digest: one for one in map(read, files)}
    rows = judge([row for rows in every for row in rows], found)
    answered = [row for row in rows if row["x"] is not None]
    ended = any(row["verdict"] in (CRASHED, HUNG, RAISED) for row in rows)
    well = bool(answered) and not ended and all(row["same"] for row in answered)
    lines = [f"{entrant.label}: {rows[0]['version']}",
             *(f"  {name:12} {_line(own)}" for name in CHECKED
               if (own := [row for row in rows if row["family"] == name])),
             "  the rules are kept" if well else
             "  the rules are broken: see docs/extending/entrant.md"]
    return "\n".join(lines), well


def _line(rows: list[Row]) -> str:
    verdicts: list[str] = [row["verdict"] for row in rows]
    said = ", ".join(f"{verdict}: {verdicts.count(verdict)}" for verdict in dict.fromkeys(verdicts))
    found: dict[str, Any] = summary(rows)
    if not {SOLVED, WRONG} & set(verdicts):
        return said
    return f"{said}; miss {found['relative']:.0e}; median {found['median_us']:.1f} us"
