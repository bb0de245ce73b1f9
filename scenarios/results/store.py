"""The table of results: rows of scenario x resolver x sample x metric, as CSV files.

`compare`, `compare --starts` and `sweep` write the same columns. pandas reads them:
`read_csv("results.csv").pivot_table("value", ["scenario", "resolver", "sample"], "metric")`.
"""

import codecs
import csv
import io
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hierarchy.errors import HierarchyError
from scenarios import files
from scenarios.config import Scenario
from scenarios.config.validation import leaves, unit_at
from scenarios.measure.metrics import Metric
from scenarios.results.plan import Job, Outcome

COLUMNS = ("key", "scenario", "resolver", "sample", "metric", "value", "unit", "label", "group",
           "better", "note")
TABLE = "results.csv"
_SAMPLED, _RUN, _END = "Sampled", "Run", "reached_end"
_BETTER = {True: "lower", False: "higher", None: ""}
_LOWER = {word: lower for lower, word in _BETTER.items()}


class StoreError(HierarchyError):
    """A folder that is in use or not a sweep's, or a file that cannot be read."""


class FullError(OSError):
    """A file that cannot be written, such as on a full disk; what was written before is kept."""


@dataclass(frozen=True)
class Store:
    """The folder of a sweep: `runs/` with the rows of each writer as they come, and the results.

    part : name of this writer's file in `runs/`.
    """

    folder: Path
    part: str = "all"

    @property
    def file(self) -> Path:
        """The file that this writer appends to."""
        return self.folder / "runs" / f"{self.part}.csv"

    @contextmanager
    def opened(self) -> Iterator[None]:
        """Lock this writer's file for this process; make the folder if it is new.

        What a writer that was stopped left of its last run, as on a full disk, is cut off.

        Raises
        ------
        StoreError : the folder has other content.
        OutputError : it cannot be made, or another process writes the file.
        """
        if self.folder.is_dir() and not (self.folder / "runs").is_dir() and any(
                self.folder.iterdir()):
            raise StoreError(f"output folder {self.folder} is not empty and is not a sweep's; "
                             "choose another, or remove it first")
        files.make_folder(self.folder / "runs")
        with files.named(self.folder):
            files.lock(self.file.resolve())
        try:
            with suppress(FileNotFoundError, ValueError, csv.Error):  # what is damaged stays
                os.truncate(self.file, len(_ended(self.file.read_bytes()).encode()))
            yield
        finally:
            files.unlock(self.file.resolve())
            for made in (self.file.parent, self.folder):  # before any run, such as at Ctrl-C
                files.remove_empty(made)

    def add(self, job: Job, outcome: Outcome) -> None:
        """Append the rows of a run, which are on the disk on return; raises FullError."""
        new = not (self.file.exists() and self.file.stat().st_size)
        text = _as_text([COLUMNS] * new + rows(job, outcome))
        with writing(self.file), self.file.open("ab") as stream:
            stream.write(text.encode(errors="backslashreplace"))  # paths may not be UTF-8
            stream.flush()
            os.fsync(stream.fileno())

    def outcomes(self) -> dict[str, Outcome]:
        """Return all finished runs by key; raises StoreError for a damaged file."""
        return {key: one for file in sorted((self.folder / "runs").glob("[!.]*.csv"))
                for key, one in read(file).items()}


def rows(job: Job, outcome: Outcome) -> list[tuple[Any, ...]]:
    """Return the rows of a run; the last one says whether it reached its end, or why not."""
    head = job.key, job.scenario, job.resolver, job.sample
    sampled = [(name, value, unit_at(Scenario, key.split(".")), name, _SAMPLED, "", "")
               for key, one in job.values.items() for name, value in leaves(one, key)]
    found = [(m.name, m.value, m.unit, m.label, m.group, _BETTER[m.lower_is_better], m.note)
             for m in outcome.metrics]
    told = [("ticks", outcome.ticks, "", "Ticks", _RUN, "", ""),
            ("wall_seconds", outcome.wall_seconds, "s", "Time of the run", _RUN, "", ""),
            (_END, int(outcome.reason is None), "", "Reached the end", _RUN, "higher",
             outcome.reason or "")]
    return [(*head, *row) for row in (*sampled, *found, *told)]


def write_table(file: Path, found: Iterable[tuple[Job, Outcome]]) -> None:
    """Write the rows of runs, whole or not at all; raises FullError."""
    with writing(file):
        files.write_text(file, _as_text([COLUMNS, *(row for one in found for row in rows(*one))]))


def _as_text(lines: Iterable[Sequence[Any]]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(lines)
    return text.getvalue().replace("\r", " ")  # csv does not quote it, and reads it as a line's end


def read(file: Path) -> dict[str, Outcome]:
    """Return the runs of a file by key, without those whose last row is missing.

    Raises StoreError if it cannot be read.
    """
    found: dict[str, Outcome] = {}
    metrics: dict[str, dict[str, Metric]] = {}
    try:
        for row in csv.DictReader(io.StringIO(_ended(file.read_bytes()), newline="")):
            if None in row.values() or row["group"] == _SAMPLED:
                continue
            key, name = row["key"], row["metric"]
            value = None if row["value"] in ("", "nan") else float(row["value"])
            of = metrics.setdefault(key, {})
            of[name] = Metric(name, row["label"], value, row["unit"], _LOWER[row["better"]],
                              row["group"], row["note"])
            if name == _END:
                measured = tuple(one for one in of.values() if one.group != _RUN)
                found[key] = Outcome(key, int(of["ticks"].value or 0), row["note"] or None,
                                     of["wall_seconds"].value, measured)
    except (OSError, ValueError, KeyError, csv.Error) as error:
        raise StoreError(f"{file} cannot be read ({error}); remove it to repeat its "
                         "runs") from error
    return found


def _ended(content: bytes) -> str:
    """Return the text of the runs of a file that were written to their end.

    What follows may end in the middle of a row, a text in quotes or a character. Raises ValueError
    or csv.Error for what is damaged elsewhere.
    """
    text = codecs.getincrementaldecoder("utf-8")().decode(content)
    lines, end = list(io.StringIO(text, newline="")), 0
    cut = not text.endswith("\n") or text.count('"') % 2 == 1
    reader = csv.reader(lines)
    for row in reader:
        whole = reader.line_num < len(lines) or not cut
        end = reader.line_num if whole and _END in row[4:5] else end
    return "".join(lines[:end])


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Turn an OSError into a FullError that names the file."""
    try:
        yield
    except OSError as error:
        raise FullError(f"{path} cannot be written: {files.reason(error)}; finished runs are "
                        "kept") from error
