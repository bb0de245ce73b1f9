"""The folder of one run: what was recorded, its metrics and its figures."""

from __future__ import annotations

from pathlib import Path

from scenarios.draw.figures import letter
from scenarios.files import whole, write_json
from scenarios.loop.recording import Recording, write
from scenarios.measure import metrics


def save(recording: Recording, folder: str | Path, figures: bool = True) -> Path:
    """Write a run's folder, whole or not at all, and return its path.

    It holds what `scenarios.loop.recording.write` writes, `metrics.json`, and the letter's figures
    if `figures`. `folder` must be new or empty.
    """
    with whole(folder) as partial:
        write(recording, partial)
        write_json(partial / "metrics.json", metrics.as_plain_data(recording))
        if figures:
            letter.write_all(recording, partial)
    return Path(folder)
