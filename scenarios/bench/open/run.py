"""The open benchmark: every entrant on every family, public and fresh; continued if interrupted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from scenarios.bench.machine import machine
from scenarios.bench.open.exported import export, file_of
from scenarios.bench.open.families import Family
from scenarios.bench.open.process import LIMIT, Said, run_entrant
from scenarios.bench.open.store import RawRow, Store
from scenarios.bench.open.table import Row
from scenarios.bench.peers.environments import MissingError
from scenarios.files import write_json
from solvers.problems.files import Collection, read

Told = Callable[[str], None]


def run(folder: Path, families: Sequence[Family], entrants: Sequence[Row], seeds: Sequence[int],
        count: int | None = None, limit: float = LIMIT, told: Told = print) -> Store:
    """Write the problems, run every entrant on them, and keep the raw rows.

    What is in the folder already stays as it is: an interrupted benchmark goes on, and an entrant
    that is added later meets the same problems.

    seeds : of the halves; 0 is the public one. count : problems of a half, None for the usual
        number. limit : [s] for one problem. told : gets a line of text now and then.
    """
    store, missing = Store(folder), dict[str, str]()
    for file in _problems(store, families, seeds, count, told):
        collection = read(file)
        for row in entrants:
            target = store.file_of(row.label, file)
            if target.is_file() or row.label in missing:
                continue
            told(f"{collection.head.family}, {collection.head.half}: {row.label}")
            try:
                about, answers = run_entrant(row, file, len(collection.problems), limit)
            except MissingError as reason:
                missing[row.label] = str(reason)
                continue
            store.add(rows_of(row, collection, about, answers), target)
    write_json(folder / "machine.json", machine())
    write_json(folder / "missing.json", missing)
    return store


def _problems(store: Store, families: Sequence[Family], seeds: Sequence[int], count: int | None,
              told: Told) -> list[Path]:
    files = []
    for family in families:
        for seed in seeds:
            file = file_of(store.problems, family.name, seed)
            if not file.is_file():
                told(f"{family.name}, seed {seed}: problems and their proofs")
                export(family, seed, count, True, store.problems)
            files.append(file)
    return files


def rows_of(row: Row, collection: Collection, about: Said, answers: Sequence[Said]
            ) -> list[RawRow]:
    """Return the raw rows of an entrant on a file, from what `run_entrant` returned."""
    head = collection.head
    same: dict[str, Any] = {
        "entrant": row.label, "version": about["version"], "family": head.family,
        "half": head.half, "seed": head.seed, "sha256": collection.digest,
        "yardstick_ns": about["yardstick_ns"], "start_kib": about["rss_kib"]}
    return [{**same, **answer} for answer in answers]
