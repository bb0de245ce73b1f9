"""`hierarchy replay`: write finished runs as one HTML file, or one as a video."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from hierarchy.errors import HierarchyError
from scenarios.draw.viewer.view import labelled
from scenarios.files import named, write_text
from scenarios.measure.run_folder import load_run


def replay_command(folders: Sequence[Path], out: Path | None, video: Path | None,
                   rate: float) -> int:
    """Write the HTML file, the video, or both, and print their paths; by default replay.html."""
    recordings = labelled(folders, [load_run(folder) for folder in folders])
    if video is not None:
        if len(recordings) > 1:
            raise HierarchyError("--video shows one run; give one folder, or --out for several")
        from scenarios.cli.progress import bar
        from scenarios.draw.replay.video import write_video

        with bar("frames") as told:
            write_video(next(iter(recordings.values())), video, rate=rate,
                        progress=partial(told, "video"))
        _say(video)
    if out is not None or video is None:
        from scenarios.draw.replay.page import html

        titles = dict.fromkeys(one.scenario.title or one.scenario.name
                               for one in recordings.values())
        target = out if out is not None else folders[0] / "replay.html"
        text = html(recordings, " · ".join(titles), rate=rate)
        with named(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            write_text(target, text)
        _say(target)
    return 0


def _say(path: Path) -> None:
    print(f"{path}, {path.stat().st_size / 1e3:.0f} kB")
