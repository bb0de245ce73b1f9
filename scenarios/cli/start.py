"""The entry of the command `hierarchy`: what has to be set before anything large is imported."""

import os
import signal
import sys
from typing import Any


def main() -> None:
    """Run the command line and exit with its code."""
    _open_streams()
    # Until then signals end the command at once, as process 1 too, which has no default for them.
    handled = [number for name in ("SIGINT", "SIGTERM", "SIGHUP")
               if (number := getattr(signal, name, None)) is not None
               and signal.getsignal(number) is not signal.SIG_IGN]
    for number in handled:
        signal.signal(number, signal.SIG_DFL if os.getpid() != 1 else
                      lambda number, _: os._exit(128 + number))
    try:
        from scenarios.cli.main import interrupted, run_command
    except ModuleNotFoundError as error:
        from hierarchy.errors import missing

        sys.exit(f"hierarchy: error: {missing(error, 'scenarios')}")
    asked: list[int] = []

    def end(number: int, _: object) -> None:
        asked.append(number)
        raise KeyboardInterrupt  # what is made so far is kept

    def again(about: Any) -> None:
        """Interrupt a little later what has dropped it, as callbacks of LLVM do."""
        if about.exc_type is not KeyboardInterrupt:
            sys.__unraisablehook__(about)
        elif hasattr(signal, "setitimer"):  # not on Windows
            signal.signal(signal.SIGALRM, end)
            signal.setitimer(signal.ITIMER_REAL, 0.01)

    sys.unraisablehook = again
    for number in handled:
        signal.signal(number, end)
    try:
        sys.exit(run_command(sys.argv[1:]))
    except Exception:
        if not asked:
            raise
        sys.exit(interrupted())  # a callback of LLVM dropped it, and compiling breaks


def _open_streams() -> None:
    """Give closed standard streams nowhere to go, and replace what a terminal cannot show."""
    opened = os.open(os.devnull, os.O_RDWR)
    while opened < 3:  # the lowest free number, which a file would otherwise get
        os.set_inheritable(opened, True)
        opened = os.dup(opened)
    os.close(opened)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: PTH123, SIM115
        getattr(sys, name).reconfigure(errors="replace")


if __name__ == "__main__":
    main()
