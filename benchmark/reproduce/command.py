"""`hierarchy reproduce`: make the numbers of the documents, and write them into the pages."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from scenarios.cli.options import AsJson, Workers, output


def reproduce(names: Annotated[list[str] | None, typer.Argument(
                  metavar="[NAME]...", help="`protocol`, the runs of docs/protocol.md, `fronts`, "
                  "tuned methods, or a page such as docs/results/problems.md for the commands in "
                  "it. Default: all.")] = None,
              out: Annotated[Path, output("Where the runs are stored.")] = Path("runs/reproduce"),
              quick: Annotated[bool, typer.Option(
                  "--quick", help="The first seed only; leave the documents as they are.")
                  ] = False,
              fill: Annotated[bool, typer.Option(
                  "--fill", help="Run nothing; write the pages from what docs/results has.")
                  ] = False,
              workers: Workers = None, as_json: AsJson = False) -> int:
    """Regenerate the numbers in the documentation.

    They are written into the pages of a checkout as each seed or command ends. Run the same
    command again to resume an interrupted one. Nothing else should run while timings are made.
    """
    from benchmark.reproduce import whole

    return whole.fill() if fill else whole.run(names or [], out, quick, workers, as_json)
