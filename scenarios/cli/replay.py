"""`hierarchy replay`: write finished runs as one HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenarios.draw.replay.page import html
from scenarios.draw.viewer.view import labelled
from scenarios.files import named, write_text
from scenarios.measure.run_folder import load_run


def replay_command(folders: Sequence[Path], out: Path | None, rate: float) -> int:
    """Write the HTML file, by default replay.html of the first run, and print its path."""
    recordings = labelled(folders, [load_run(folder) for folder in folders])
    titles = dict.fromkeys(one.scenario.title or one.scenario.name for one in recordings.values())
    target = out if out is not None else folders[0] / "replay.html"
    text = html(recordings, " · ".join(titles), rate=rate)
    with named(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        write_text(target, text)
    print(f"{target}, {target.stat().st_size / 1e3:.0f} kB")
    return 0
