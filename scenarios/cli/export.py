"""`hierarchy export`: a run's folder as a file that other programs open."""

from __future__ import annotations

from pathlib import Path

from scenarios.export import export
from scenarios.loop.recording import load_run


def export_command(folder: Path, format: str | None, out: Path | None) -> list[Path]:
    """Export a run and return what was written; see `export`.

    Without `out` it is run.FORMAT in the run's folder; without both, run.csv there.
    """
    path = out if out is not None else folder / f"run.{format or 'csv'}"
    return export(load_run(folder), path, format)
