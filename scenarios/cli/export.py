"""`hierarchy export`: write a run in a format for other programs."""

from __future__ import annotations

from pathlib import Path

from scenarios.export import export
from scenarios.measure.run_folder import load_run


def export_command(folder: Path, format: str | None, out: Path | None) -> list[Path]:
    """Export a run and return the files written; see `export`.

    `out` is run.FORMAT in the run's folder by default; the default format is CSV.
    """
    path = out if out is not None else folder / f"run.{format or 'csv'}"
    return export(load_run(folder), path, format)
