"""The entry of the command `hierarchy`: Ctrl-C ends it quietly while it is still importing."""

from __future__ import annotations

import signal


def main() -> None:
    """Run the command line and exit with its code."""
    before = signal.signal(signal.SIGINT, signal.SIG_DFL)
    from scenarios.cli.main import main as run

    signal.signal(signal.SIGINT, before)
    run()


if __name__ == "__main__":
    main()
