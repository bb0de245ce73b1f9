"""What `hierarchy view` does."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


def view_command(folders: Sequence[Path], port: int, side_by_side: bool, browser: bool) -> int:
    """Show finished runs until Ctrl-C, and return the exit code 0."""
    from scenarios.recording import load_run
    from scenarios.viewer.server import announce, open_server
    from scenarios.viewer.view import View, labelled

    runs = labelled(folders, [load_run(folder) for folder in folders])
    server = open_server(port, "hierarchy view")
    try:
        view = View(server, runs, side_by_side)
        announce(server, browser)
        view.serve()
    except KeyboardInterrupt:
        print()
    finally:
        server.stop()
    return 0
