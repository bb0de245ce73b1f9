"""The open benchmark: every solver on every family, public and fresh; continued if interrupted."""

import gzip
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmark.packages import Entrant
from benchmark.process import CRASHED, HUNG, Field
from benchmark.report import Report, Row, Section, Table, tell
from benchmark.solve import views
from benchmark.solve.entrants import ABSENT, ENTRANTS
from benchmark.solve.judge import ENDED, RAISED, by, cells, judge, miss_of
from hierarchy.errors import refuse
from hierarchy.words import gathered
from scenarios.files import make_folder, named, slug, write_json, written
from scenarios.problems.families import FAMILIES, Family, export, file_of, save
from scenarios.results.store import StoreError
from solvers.problems.files import Collection, read
from solvers.proof import prove

QUESTIONS = "benchmark.solve.interface:Questions"
LIMIT = 10.0     # [s] of processor time for one problem with all its repetitions
PATIENCE = 10.0  # [s] of processor time for a file, after which an entrant is not asked the rest
BORDERS = tuple(10.0**-k for k in range(12, 4, -1))  # angles and lengths as proof.UNCLEAR
MOST_ENDS = 5    # crashes and hangs of an entrant on a file, after which the rest is left out
CHECKED = ("EQ7", "EQ7sing", "INEQ7", "tied_box", "contacts", "mixed_units", "one_unknown")
_CHECKS = 4  # problems of each of them
_ALIKE = 7   # digits of x / (1 + |x|) in which candidates for a proof count as one
_BREAKS = {RAISED: "raises", CRASHED: "ends its process", HUNG: "takes longer than --limit"}


def _rows_of(entrant: str, file: Path) -> Path:
    """Return where the rows of an entrant on a file of problems belong."""
    return file.parents[1] / "rows" / f"{slug(entrant)}--{file.stem}.jsonl.gz"


def _rows(folder: Path) -> list[Row]:
    """Return all rows of a benchmark; raises StoreError for a file that is damaged."""
    rows = list[Row]()
    for file in sorted((folder / "rows").glob("[!.]*.jsonl.gz")):
        try:
            with gzip.open(file, "rt") as lines:
                rows += map(json.loads, lines)
        except (OSError, EOFError, ValueError) as error:
            raise StoreError(f"{file} cannot be read ({error}); remove it to run its entrant again"
                             ) from error
    return rows


def _notes(folder: Path, name: str) -> dict[str, str]:
    """Return what NAME.json says, {} if there is none yet."""
    file = folder / f"{name}.json"
    found: dict[str, str] = json.loads(file.read_text("utf-8")) if file.is_file() else {}
    return found


def _write(rows: Iterable[Row], file: Path) -> None:
    """Write the rows of one entrant on one file of problems, whole or not; see OutputError."""
    make_folder(file.parent)
    with named(file), written(file) as partial, gzip.open(partial, "wt") as lines:
        lines.writelines(json.dumps(row) + "\n" for row in rows)


def run(folder: Path, families: Sequence[Family], entrants: Sequence[Entrant],
        counts: Mapping[int, int | None], limit: float = LIMIT) -> None:
    """Write the problems, let all entrants take turns with each, and keep the raw rows.

    The folder gets `problems/`, `rows/`, and what is known of the entrants. What is there already
    stays as it is: an interrupted benchmark goes on, and an entrant that is added later meets the
    same problems. What entrants find goes to the prover where no proof is complete.

    counts : problems of each set, by its seed, None for the usual number; 0 is the public set.
    limit : [s] for one problem.
    """
    problems, left = folder / "problems", dict[Path, list[str]]()
    refuse(folder.is_dir() and not problems.is_dir() and any(folder.iterdir()),
           f"output folder {folder} is not empty and is no benchmark's; choose another, or remove "
           "it first")
    for family, (seed, count) in product(families, counts.items()):
        file = file_of(problems, family.name, seed)
        if not file.is_file():
            tell(f"{family.name}, seed {seed}: problems and their proofs")
            export(family, seed, count, True, problems)
        elif count not in (None, there := len(read(file).problems)):
            tell(f"{file.stem} has {there} problems, not {count}: they stay as they are")
        left[file] = [one.label for one in entrants if not _rows_of(one.label, file).is_file()]
    write_json(make_folder(folder) / "limits.json", _notes(folder, "limits") | {
        one.label: one.limits for one in entrants})
    with Field([one for one in entrants if any(one.label in some for some in left.values())],
               QUESTIONS) as field:
        missing = {label: why for label, why in _notes(folder, "missing").items()
                   if all(one.label != label for one in entrants)}
        write_json(folder / "missing.json", missing | field.missing)
        for file, labels in left.items():
            if some := [label for label in labels if label in field.running]:
                tell(f"{file.stem}: {len(some)} entrants")
                found = asked(field, file, limit, some)
                for label, rows in found.items():
                    _write(rows, _rows_of(label, file))
                improve(file, found.values())


def asked(field: Field, file: Path, limit: float = LIMIT, labels: Sequence[str] | None = None
          ) -> dict[str, list[Row]]:
    """Return the raw rows of entrants that take turns with each problem of a file."""
    one = read(file)
    same = {"family": one.head.family, "half": one.head.half, "seed": one.head.seed,
            "sha256": one.digest}
    questions = [("problem", str(file.resolve()), p) for p in range(len(one.problems))]
    return {label: [{"entrant": label, "version": field.running[label].about["version"], **same,
                     "problem": p, **row} for p, row in enumerate(answers)]
            for label, answers in field.answers(questions, limit, MOST_ENDS, labels,
                                                 PATIENCE).items()}


def improve(file: Path, found: Iterable[list[Row]]) -> None:
    """Let the answers of all entrants be candidates where levels of a file are not yet proved."""
    one, rows = read(file), list(zip(*found, strict=True))
    proofs = list(one.answers or ())
    for p, (h, proof) in enumerate(zip(one.problems, proofs, strict=False)):
        if rows and proof.proved < min(proof.posed, len(h.sizes) + 1):
            xs = [np.array(row["x"]) for row in rows[p] if row.get("x") is not None]
            alike = {np.round(x / (1.0 + np.linalg.norm(x)), _ALIKE).tobytes(): x for x in xs
                     if miss_of(h, proof, x).level < 0}
            proofs[p] = max(proof, prove(h, alike.values()), key=lambda one: one.judged)
    if any(new is not old for new, old in zip(proofs, one.answers or (), strict=False)):
        save(replace(one, answers=tuple(proofs)), file.parent)


def prove_at_borders(folder: Path) -> None:
    """Prove the answers of a folder at each of BORDERS, into `borders/`, from those of entrants.

    The border decides which rows are dependent, and so which problems are well posed.
    """
    xs = gathered(((row["sha256"], row["problem"]), np.array(row["x"]))
                  for row in _rows(folder) if row.get("solved"))
    for border, file in product(BORDERS, sorted((folder / "problems").glob("[!.]*.npz"))):
        out = folder / "borders" / f"{border:g}"
        if not (out / file.name).is_file():
            one = read(file)
            save(replace(one, answers=tuple(
                prove(h, xs.get((one.digest, p), []), border)
                for p, h in enumerate(one.problems))), out)


def report(folder: Path) -> Report:
    """Return what a folder has, judged anew; raises HierarchyError if it has no rows.

    Each set has a section, fresh ones first; no number is of two sets together.
    """
    order, labels = [*FAMILIES], [one.label for one in ENTRANTS]
    raw = sorted(_rows(folder), key=lambda row: (_place(order, row["family"]),
                                                _place(labels, row["entrant"])))
    found = _problems(folder / "problems")
    rows = judge(raw, {one.digest: one for one in found})
    at = {float(border.name): judge(raw, {one.digest: one for one in _problems(border)})
          for border in (folder / "borders").glob("[!.]*")}
    refuse(not rows, f"{folder} has no rows of a benchmark: run `hierarchy bench "
           "open` first")
    sections, kept = [], list[Row]()
    for seed in sorted({row["seed"] for row in rows}, key=lambda seed: (seed == 0, seed)):
        title = f"Fresh problems, seed {seed}" if seed else "Public problems"
        section, some = views.section(
            title, [row for row in rows if row["seed"] == seed],
            {one.head.family: one for one in found if one.head.seed == seed},
            {border: [row for row in of if row["seed"] == seed] for border, of in at.items()})
        sections.append(section)
        kept += [{"half": title, **row} for row in some]
    versions = {row["entrant"]: row["version"] for row in rows}
    return Report("The open benchmark of prioritized control", [
        *sections, views.entrants(versions, _notes(folder, "limits"))], {"summary": kept},
        _notes(folder, "missing") | ABSENT)


def _problems(folder: Path) -> list[Collection]:
    return [read(file) for file in sorted(folder.glob("[!.]*.npz"))]


def _place(order: Sequence[str], name: str) -> int:
    return order.index(name) if name in order else len(order)


def check(entrants: Sequence[Entrant], limit: float = LIMIT) -> Report:
    """Try entrants on a few problems of each kind; it has failed unless all keep the rules.

    limit : [s] for one problem.
    """
    with TemporaryDirectory() as folder, Field(entrants, QUESTIONS) as field:
        files = [export(FAMILIES[name], 0, _CHECKS, True, Path(folder)) for name in CHECKED]
        rows = [row for file in files for own in asked(field, file, limit).values() for row in own]
        judged = by(judge(rows, {one.digest: one for one in map(read, files)}), "entrant")
    broken = {label: _broken(own) for label, own in judged}
    return Report("A few problems of each kind", [
        Section("", [Table(f"{label}: {own[0]['version']}", cells(own), views.IN_SHORT, "family")],
                lead=[f"a rule is broken: {rule}" for rule in broken[label]]
                or ["the rules are kept"]) for label, own in judged],
        missing=field.missing, failed=bool(field.missing or any(broken.values())))


def _broken(rows: Sequence[Row]) -> list[str]:
    """Return the rules of docs/extending/entrant.md that an entrant has broken."""
    early = {row["verdict"]: row.get("raised") or row.get("why") or "" for row in rows
             if row["verdict"] in ENDED}
    rules = [f"{row['family']}, problem {row['problem']}: other bits the second time"
             for row in rows if row.get("same") is False]
    return [*(f"it {_BREAKS[verdict]}: {why}" for verdict, why in early.items()), *rules[:1],
            *(["it answers nothing"] if all(row["x"] is None for row in rows) else [])]
