"""`hierarchy bench open`: choose families and entrants, run, print, write the page."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.console import Console

from scenarios.bench.open.families import available, family, unavailable
from scenarios.bench.open.table import PACKAGES, Row, chosen
from scenarios.cli.terminal import shown


def open_command(families: Sequence[str], entrants: Sequence[str],
                 counts: Mapping[int, int | None], limit: float, python: str,
                 built: dict[str, Path | None], out: Path) -> int:
    """Run the benchmark, or what is left of it; print its tables and write its page."""
    from scenarios.bench.open.page import page
    from scenarios.bench.open.printing import say
    from scenarios.bench.open.results import results
    from scenarios.bench.open.run import run
    from scenarios.files import write_text

    table = _table(entrants, python, built)
    named = [family(name) for name in families] or available()
    for name, why in ({} if families else unavailable()).items():
        print(f"left out: {name}, which {why}", file=sys.stderr)
    run(out, named, table, counts, limit,
        lambda text: print(text, file=sys.stderr, flush=True))
    found = results(out)
    say(Console(highlight=False, markup=False), found)
    write_text(out / "index.html", page(found, shlex.join(["hierarchy", *sys.argv[1:]])))
    print(f"\nPage: {shown(out / 'index.html')}")
    return 0


def check_command(entrants: Sequence[str], python: str, built: dict[str, Path | None]) -> int:
    """Try entrants on a few problems; exit code 1 if one of them ends or contradicts itself."""
    from scenarios.bench.open.check import check

    passed = True
    for row in _table(entrants, python, built):
        found = check(row)
        passed = passed and found.well
        print(found)
    return int(not passed)


def install_command() -> int:
    """Make the environments of the packages."""
    from scenarios.bench.peers.environments import install

    said = install(PACKAGES)
    for name, why in said.items():
        print(f"{name}: {why or 'installed'}")
    return int(any(said.values()))


def _table(entrants: Sequence[str], python: str, built: dict[str, Path | None]) -> list[Row]:
    """Return the rows that are asked for, among them those built from checkouts, and ours in C."""
    from scenarios.bench.open.built import ours, rows_of

    more = [row for name, folder in built.items() if folder is not None
            for row in rows_of(name, folder)]
    return chosen(entrants, python, [*ours(), *more] if more else [])
