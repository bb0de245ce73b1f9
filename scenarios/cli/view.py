"""`hierarchy view` and `hierarchy run --live`."""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scenarios.config import Scenario
    from scenarios.draw.viewer.live_page import LivePage

_POLL = 0.05  # [s] between two looks for the first browser


def view_command(folders: Sequence[Path], port: int, side_by_side: bool, browser: bool) -> int:
    """Show finished runs until Ctrl-C, and return the exit code 0."""
    from scenarios.draw.viewer.server import announce, close, open_server
    from scenarios.draw.viewer.view import View, labelled
    from scenarios.measure.run_folder import load_run

    found = [run for folder in folders for run in _runs_in(folder)]
    runs = labelled(found, [load_run(folder) for folder in found])
    names = dict.fromkeys(run.scenario.name for run in runs.values())
    server = open_server(port, ", ".join(names))
    try:
        view = View(server, runs, side_by_side)
        announce(server, browser)
        view.serve()
    except KeyboardInterrupt:
        print()
    finally:
        close(server)
    return 0


def _runs_in(folder: Path) -> list[Path]:
    """Return a run folder, or those of a comparison."""
    if (folder / "comparison.json").is_file():
        return sorted(file.parent for file in folder.glob("*/*/run.npz"))
    return [folder]


def live_command(scenario: Scenario, folder: Path, port: int, speed: float, browser: bool,
                 wait: bool = True) -> int:
    """Run a scenario live in the browser, save the run, and return 1 if it stopped with a fault.

    With `wait` the run starts when the first browser has opened the page.

    The run is saved when it ends or at Ctrl-C, in `folder` or, after a restart, beside it. A run
    that is restarted before its end is not saved.
    """
    from scenarios.draw.viewer.live import Live
    from scenarios.draw.viewer.live_page import LivePage
    from scenarios.draw.viewer.server import announce, close, open_server

    live = Live(scenario)
    server = open_server(port, f"{scenario.name}, live")
    page = LivePage(server, live, speed)
    try:
        announce(server, browser)
        while wait and not server.get_clients():
            time.sleep(_POLL)
        _serve(page, folder)
    except KeyboardInterrupt:
        print()
        if not live.over:
            _keep(page, folder)
    finally:
        close(server)
    return 1 if live.ending else 0


def _serve(page: LivePage, folder: Path) -> None:
    """Continue the run until Ctrl-C, and save it whenever it ends."""
    from scenarios.draw.viewer.live_page import FRAMES

    last, kept = time.monotonic(), None
    while True:
        time.sleep(1.0 / FRAMES)
        now = time.monotonic()
        page.step(now - last)
        last = now
        if page.live.over and kept is not page.live.recorder:
            kept = page.live.recorder
            _keep(page, folder)


def _keep(page: LivePage, folder: Path) -> None:
    """Save the run in its folder, or in the next free one beside it."""
    beside = (folder.with_name(f"{folder.name}-{i}") for i in itertools.count(2))
    free = next(path for path in itertools.chain([folder], beside)
                if not path.exists() or not any(path.iterdir()))
    recording = page.live.save(free)
    print(f"{recording.ticks} ticks in {free}", flush=True)
    if recording.fault:
        print(f"hierarchy: fault: {recording.fault}", file=sys.stderr)
