"""The folder of one run: its recording and its metrics."""

from __future__ import annotations

from pathlib import Path

from hierarchy.errors import expect, file_path
from scenarios.files import whole, write_json
from scenarios.loop.recording import Recording, write
from scenarios.measure import metrics


def save(recording: Recording, folder: str | Path) -> Path:
    """Write a run's folder, completely or not at all, and return its path.

    It has the files of `scenarios.loop.recording.write` and `metrics.json`; `hierarchy figures`
    adds the figures. `folder` must be new or empty.
    """
    expect("save", recording, Recording, "give what `simulate` returns")
    with whole(file_path("save", folder)) as partial:
        write(recording, partial)
        write_json(partial / "metrics.json", metrics.as_plain_data(recording))
    return Path(folder)
