"""The open benchmark: every entrant on every family, public and fresh; continued if interrupted."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scenarios.bench.machine import machine
from scenarios.bench.open.exported import export, file_of
from scenarios.bench.open.families import Family
from scenarios.bench.open.process import LIMIT, Said, run_entrant
from scenarios.bench.open.store import COLUMNS, RawRow, Store
from scenarios.bench.open.table import Row
from scenarios.bench.peers.environments import MissingError
from scenarios.files import write_json
from solvers.problems.files import Collection, read

MACHINE, MISSING, LIMITS = "machine.json", "missing.json", "limits.json"

Told = Callable[[str], None]


def run(folder: Path, families: Sequence[Family], entrants: Sequence[Row],
        counts: Mapping[int, int | None], limit: float = LIMIT, told: Told = print) -> Store:
    """Write the problems, run every entrant on them, and keep the raw rows.

    What is in the folder already stays as it is: an interrupted benchmark goes on, and an entrant
    that is added later meets the same problems.

    counts : problems of each half, by its seed, None for the usual number; 0 is the public half.
    limit : [s] for one problem. told : gets a line of text now and then.
    """
    store = Store(folder)
    missing, limits = read_json(folder / MISSING), read_json(folder / LIMITS)
    files = _problems(store, families, counts, told)
    write_json(folder / MACHINE, machine())
    collections = [read(file) for file in files]
    for row in entrants:
        told(row.label)
        limits[row.label] = row.limits
        missing.pop(row.label, None)
        try:
            _add(store, row, files, collections, limit)
        except MissingError as reason:
            missing[row.label] = str(reason)
        write_json(folder / LIMITS, limits)
        write_json(folder / MISSING, missing)
    return store


def read_json(file: Path) -> dict[str, str]:
    """Return what a file of the folder says, {} if there is none yet."""
    found: dict[str, str] = json.loads(file.read_text("utf-8")) if file.is_file() else {}
    return found


def _add(store: Store, row: Row, files: Sequence[Path], collections: Sequence[Collection],
         limit: float) -> None:
    """Run an entrant on the files on which it has not run yet."""
    left = [(file, one, store.file_of(row.label, file))
            for file, one in zip(files, collections, strict=True)]
    left = [(file, one, target) for file, one, target in left if not target.is_file()]
    if left:
        said = run_entrant(row, [file for file, _, _ in left],
                           [len(one.problems) for _, one, _ in left], limit)
        for (_, one, target), (about, answers) in zip(left, said, strict=True):
            store.add(rows_of(row, one, about, answers), target)


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


def rows_of(row: Row, collection: Collection, about: Said, answers: Sequence[Said]
            ) -> list[RawRow]:
    """Return the raw rows of an entrant on a file, from what `run_entrant` returned."""
    head = collection.head
    same: dict[str, Any] = {
        "entrant": row.label, "version": about["version"], "family": head.family,
        "half": head.half, "seed": head.seed, "sha256": collection.digest,
        "yardstick_ns": about.get("yardstick_ns"), "start_kib": about.get("start_kib")}
    return [{**dict.fromkeys(COLUMNS), **same, **answer} for answer in answers]
