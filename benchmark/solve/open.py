"""The open benchmark: every solver on every family, public and fresh; continued if interrupted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmark.machine import machine
from benchmark.packages import Entrant, MissingError
from benchmark.process import CRASHED, HUNG, Process, staged
from benchmark.report import Report
from benchmark.solve import views
from benchmark.solve.entrants import ENTRANTS
from benchmark.solve.judge import RAISED, SOLVED, WRONG, by, judge, summary
from benchmark.store import Row, Store
from hierarchy.errors import HierarchyError
from scenarios.problems.answers import export, file_of
from scenarios.problems.families import FAMILIES, Family
from solvers.problems.files import read

QUESTIONS = "benchmark.solve.questions:Questions"
LIMIT = 10.0     # [s] for one problem with all its repetitions
MOST_ENDS = 5    # crashes and hangs of an entrant on a file, after which the rest is left out
CHECKED = ("EQ7", "EQ7sing", "INEQ7", "tied_box", "contacts", "mixed_units", "one_unknown")
_CHECKS, _CHECK_LIMIT = 4, 2.0  # problems of each of them; [s] for each problem


def run(folder: Path, families: Sequence[Family], entrants: Sequence[Entrant],
        counts: Mapping[int, int | None], limit: float = LIMIT,
        told: Callable[[str], None] = print) -> Store:
    """Write the problems, run every entrant on them, and keep the raw rows.

    What is in the folder already stays as it is: an interrupted benchmark goes on, and an entrant
    that is added later meets the same problems.

    counts : problems of each set, by its seed, None for the usual number; 0 is the public set.
    limit : [s] for one problem. told : gets a line of text now and then.
    """
    store, files = Store(folder), []
    for family in families:
        for seed, count in counts.items():
            files.append(file_of(store.problems, family.name, seed))
            if not files[-1].is_file():
                told(f"{family.name}, seed {seed}: problems and their proofs")
                export(family, seed, count, True, store.problems)
    missing, limits = store.notes("missing"), store.notes("limits")
    store.note("machine", machine())
    for one in entrants:
        told(one.label)
        limits[one.label] = one.limits
        missing.pop(one.label, None)
        left = [file for file in files if not store.file_of(one.label, file).is_file()]
        try:
            for file, rows in zip(left, asked(one, left, limit) if left else (), strict=True):
                store.add(rows, store.file_of(one.label, file))
        except MissingError as reason:
            missing[one.label] = str(reason)
        store.note("limits", limits)
        store.note("missing", missing)
    return store


def asked(entrant: Entrant, files: Sequence[Path], limit: float = LIMIT) -> Iterator[list[Row]]:
    """Yield the raw rows of an entrant on each file; raises MissingError if it cannot start."""
    with staged() as folder, Process(entrant, QUESTIONS, folder) as process:
        for file in files:
            one = read(file)
            same = {"entrant": entrant.label, "version": process.about["version"],
                    "family": one.head.family, "half": one.head.half, "seed": one.head.seed,
                    "sha256": one.digest}
            answers = process.answers((("problem", str(file.resolve()), p)
                                       for p in range(len(one.problems))), limit, MOST_ENDS)
            yield [{**same, "problem": p, **row} for p, row in enumerate(answers)]


def report(store: Store) -> Report:
    """Return what a folder has, judged anew; raises HierarchyError if it has no rows.

    Each set has a section, fresh ones first; no number is of two sets together.
    """
    found = [read(file) for file in sorted(store.problems.glob("[!.]*.npz"))]
    rows = judge(store.rows(), {one.digest: one for one in found})
    if not rows:
        raise HierarchyError(f"{store.folder} has no rows of a benchmark: run `hierarchy bench "
                             "open` first")
    order, labels = [*FAMILIES], [one.label for one in ENTRANTS]
    rows.sort(key=lambda row: (_place(order, row["family"]), _place(labels, row["entrant"])))
    sections, kept = [], list[Row]()
    for seed in sorted({row["seed"] for row in rows}, key=lambda seed: (seed == 0, seed)):
        title = f"Fresh problems, seed {seed}" if seed else "Public problems"
        section, cells = views.section(
            title, [row for row in rows if row["seed"] == seed],
            {one.head.family: one for one in found if one.head.seed == seed})
        sections.append(section)
        kept += [{"half": title, **row} for row in cells]
    versions = {row["entrant"]: row["version"] for row in rows}
    return Report("The open benchmark of prioritized control",
                  [*sections, views.entrants(versions, store.notes("limits"))], {"summary": kept},
                  store.notes("missing"))


def _place(order: Sequence[str], name: str) -> int:
    return order.index(name) if name in order else len(order)


def check(entrant: Entrant) -> bool:
    """Try an entrant on a few problems of each kind; print what came of it; return if it is well.

    It must run, answer something, never end early, and give the same bits twice.
    """
    with TemporaryDirectory() as folder:
        files = [export(FAMILIES[name], 0, _CHECKS, True, Path(folder)) for name in CHECKED]
        try:
            every = [row for rows in asked(entrant, files, _CHECK_LIMIT) for row in rows]
        except MissingError as reason:
            print(f"{entrant.label}: cannot run: {reason}")
            return False
        rows = judge(every, {one.digest: one for one in map(read, files)})
    answered = [row for row in rows if row["x"] is not None]
    ended = any(row["verdict"] in (CRASHED, HUNG, RAISED) for row in rows)
    well = bool(answered) and not ended and all(row["same"] for row in answered)
    print(f"{entrant.label}: {rows[0]['version']}",
          *(f"  {name:12} {_line(own)}" for name, own in by(rows, "family")),
          "  the rules are kept" if well else
          "  the rules are broken: see docs/extending/entrant.md", sep="\n")
    return well


def _line(rows: list[Row]) -> str:
    verdicts = [row["verdict"] for row in rows]
    said = ", ".join(f"{verdict}: {verdicts.count(verdict)}" for verdict in dict.fromkeys(verdicts))
    found = summary(rows)
    return said if not {SOLVED, WRONG} & set(verdicts) else (
        f"{said}; miss {found['relative']:.0e}; median {found['median_us']:.1f} us")
