"""`hierarchy library`: write the resolvers as a C library, or check one."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path

from scenarios.cli.terminal import print_json, shown
from scenarios.files import claim, whole
from solvers.library import differs, write


def library_command(out: Path, resolvers: list[str], target: str, as_json: bool) -> int:
    """Write the library into a new folder and print what is there; return the exit code."""
    folder = claim(out)
    with whole(folder) as partial:
        made = write(partial, resolvers, target)
    if as_json:
        print_json({"folder": shown(folder), **asdict(made)})
        return 0
    print(f"for {made.machine}; kernels {made.digest}",
          *(shown(folder / name) for name in made.files), sep="\n")
    if made.shared:
        print(f"no shared library: {made.shared}")
    return 0


def check_command(folder: Path, as_json: bool) -> int:
    """Compare a library with the installed kernels; return the exit code, 1 if they differ."""
    difference = differs(folder)
    if as_json:
        print_json({"folder": shown(folder), "same": not difference, "difference": difference})
    elif difference:
        print(f"hierarchy: fault: {shown(folder)}: {difference}", file=sys.stderr)
    else:
        print(f"{shown(folder)}: same kernels as installed")
    return int(bool(difference))
