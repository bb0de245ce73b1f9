"""`hierarchy why`: say why the command of a run jumped."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill

from scenarios.cli.terminal import print_json
from scenarios.measure.jumps import jumps
from scenarios.measure.run_folder import load_run


def why_command(folder: Path, tick: int | None, as_json: bool) -> None:
    """Print the largest changes of a run's command, or that into one tick, with their causes."""
    found = jumps(load_run(folder), tick=tick)
    if as_json:
        return print_json({"jumps": [{**vars(one), "causes": [cause._asdict() for cause in
                                                              one.causes]} for one in found]})
    for one in found:
        print(f"tick {one.tick} (t = {one.t:.3f} s): {one}")
        for kind, text in one.causes or (("other", "no single cause"),):
            print(fill(f"{kind}: {text}", 80, initial_indent="  ", subsequent_indent="    "))
