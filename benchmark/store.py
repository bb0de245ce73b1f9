"""Raw rows as lines of JSON, compressed: one file for each entrant and file of problems."""

import gzip
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import final

from benchmark.tables import Row
from hierarchy.errors import HierarchyError
from scenarios.files import make_folder, named, slug, write_json, written


class StoreError(HierarchyError):
    """A file of rows that cannot be read."""


@final
@dataclass(frozen=True)
class Store:
    """The folder of a benchmark: `problems/`, `rows/`, and what is known of the entrants."""

    folder: Path

    @property
    def problems(self) -> Path:
        """The folder of the files of problems."""
        return self.folder / "problems"

    def file_of(self, entrant: str, problems: Path) -> Path:
        """Return where the rows of an entrant on a file of problems belong."""
        return self.folder / "rows" / f"{slug(entrant)}--{problems.stem}.jsonl.gz"

    def add(self, rows: Iterable[Row], file: Path) -> None:
        """Write the rows of one entrant on one file of problems, whole or not; see OutputError."""
        make_folder(file.parent)
        with named(file), written(file) as partial, gzip.open(partial, "wt") as lines:
            lines.writelines(json.dumps(row) + "\n" for row in rows)

    def rows(self) -> list[Row]:
        """Return all rows; raises StoreError for a file that is damaged."""
        return [row for file in sorted((self.folder / "rows").glob("[!.]*.jsonl.gz"))
                for row in _read(file)]

    def notes(self, name: str) -> dict[str, str]:
        """Return what NAME.json says, {} if there is none yet."""
        file = self.folder / f"{name}.json"
        found: dict[str, str] = json.loads(file.read_text("utf-8")) if file.is_file() else {}
        return found

    def note(self, name: str, content: dict[str, str]) -> None:
        """Write NAME.json."""
        make_folder(self.folder)
        write_json(self.folder / f"{name}.json", content)


def _read(file: Path) -> list[Row]:
    try:
        with gzip.open(file, "rt") as lines:
            return [json.loads(line) for line in lines]
    except (OSError, EOFError, ValueError) as error:
        raise StoreError(f"{file} cannot be read ({error}); remove it to run its entrant again"
                         ) from error
