"""Outcomes as runs end, a line of JSON each, and the table of results, as a CSV file.

That has rows of scenario x resolver x sample x metric; `compare`, `compare --starts` and `sweep`
write the same columns. pandas reads them:
`read_csv("results.csv").pivot_table("value", ["scenario", "resolver", "sample"], "metric")`.
"""

import csv
import io
import json
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
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
_BETTER = {True: "lower", False: "higher", None: ""}


class StoreError(HierarchyError):
    """A folder that is in use or not a sweep's, or a file that cannot be read."""


class FullError(OSError):
    """A file that cannot be written, such as on a full disk; what was written before is kept."""


writing = partial(files.named, error=FullError, more="; finished runs are kept")


@dataclass(frozen=True)
class Store:
    """The folder of a sweep: `runs/` with outcomes of runs as they come, and the results.

    part : name of this writer's file in `runs/`.
    """

    folder: Path
    part: str = "all"

    @property
    def file(self) -> Path:
        """The file that this writer appends to."""
        return self.folder / "runs" / f"{self.part}.jsonl"

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
            with suppress(FileNotFoundError):
                os.truncate(self.file, len(_ended(self.file)))
            yield
        finally:
            files.unlock(self.file.resolve())
            for made in (self.file.parent, self.folder):  # before any run, such as at Ctrl-C
                files.remove_empty(made)

    def add(self, outcome: Outcome) -> None:
        """Append what came of a run, which is on the disk on return; raises FullError."""
        metrics = [[*vars(one).values()] for one in outcome.metrics]
        with writing(self.file), self.file.open("a", encoding="ascii") as stream:
            # a plug-in may use bools of numpy
            stream.write(json.dumps(vars(outcome) | {"metrics": metrics}, default=bool) + "\n")
            stream.flush()
            os.fsync(stream.fileno())

    def outcomes(self) -> dict[str, Outcome]:
        """Return all finished runs by key; raises StoreError for a damaged file."""
        return {one.key: one for file in sorted((self.folder / "runs").glob("[!.]*.jsonl"))
                for one in _read(file)}


def _read(file: Path) -> list[Outcome]:
    try:
        return [Outcome(**of | {"metrics": tuple(Metric(*one) for one in of["metrics"])})
                for of in map(json.loads, _ended(file).splitlines())]
    except (OSError, ValueError, LookupError, TypeError) as error:
        raise StoreError(f"{file} cannot be read ({error}); remove it to repeat its "
                         "runs") from error


def _ended(file: Path) -> bytes:
    """Return the lines of a file that were written to their end."""
    content = file.read_bytes()
    return content[:content.rfind(b"\n") + 1]


def rows(job: Job, outcome: Outcome) -> list[tuple[Any, ...]]:
    """Return the rows of a run; the last one says whether it reached its end, or why not."""
    head = job.key, job.scenario, job.resolver, job.sample
    sampled = [(name, value, unit_at(Scenario, key.split(".")), name, "Sampled", "", "")
               for key, one in job.values.items() for name, value in leaves(one, key)]
    found = [(m.name, m.value, m.unit, m.label, m.group, _BETTER[m.lower_is_better], m.note)
             for m in outcome.metrics]
    told = [("ticks", outcome.ticks, "", "Ticks", "Run", "", ""),
            ("wall_seconds", outcome.wall_seconds, "s", "Time of the run", "Run", "", ""),
            ("reached_end", int(outcome.reason is None), "", "Reached the end", "Run", "higher",
             outcome.reason or "")]
    return [(*head, *row) for row in (*sampled, *found, *told)]


def write_table(file: Path, found: Iterable[tuple[Job, Outcome]]) -> None:
    """Write the rows of runs, whole or not at all; raises FullError."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [COLUMNS, *(row for one in found for row in rows(*one))])
    with writing(file):  # csv does not quote a \r, and reads it as a line's end
        files.write_text(file, text.getvalue().replace("\r", " "))
