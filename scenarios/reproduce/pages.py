"""Put the blocks that are made from rows into the pages of the documents."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path

from hierarchy.errors import HierarchyError
from scenarios.files import write_text
from scenarios.reproduce import commands
from scenarios.reproduce.rows import Rows

PAGES = ("README.md", "docs/reproduction.md", "docs/ladder.md", "docs/experiment.md",
         "docs/standing.md")
RESULTS = "docs/results"
_BLOCK = re.compile(r"(<!-- reproduce: (?P<name>[\w-]+) -->\n).*?(<!-- end of \w[\w-]* -->)",
                    re.DOTALL)

Block = Callable[[Mapping[str, Rows]], str]


def checkout() -> Path:
    """Return the folder of the checkout; raises HierarchyError for an installed package."""
    root = Path(__file__).parents[2]
    if not (root / "docs" / "reproduction.md").is_file():
        raise HierarchyError("the documents are not part of the installed package; run this in a "
                             "checkout, or with --quick, which writes none")
    return root


def filled(text: str, blocks: Mapping[str, Block], rows: Mapping[str, Rows], page: str) -> str:
    """Return a page with the content of its blocks made anew.

    Raises HierarchyError, naming the page, for an unknown block or a study without rows.
    """
    def made(match: re.Match[str]) -> str:
        name = match["name"]
        if name not in blocks:
            raise HierarchyError(f"{page}: there is no block {name!r}")
        try:
            return f"{match[1]}{blocks[name](rows).rstrip()}\n{match[3]}"
        except KeyError as error:
            raise HierarchyError(f"{page}: block {name!r}: no rows of study {error}") from None

    return _BLOCK.sub(made, text)


def write(root: Path, blocks: Mapping[str, Block], rows: Mapping[str, Rows]
          ) -> tuple[list[Path], list[str]]:
    """Fill the pages of a checkout; return those that changed, and why others cannot be filled."""
    changed, lacking = [], []
    for name in dict.fromkeys((*PAGES, *commands.PAGES)):
        path = root / name
        text = path.read_text(encoding="utf-8")
        try:
            made = commands.filled(filled(text, blocks, rows, name), root, name)
        except HierarchyError as error:
            lacking.append(str(error))
            continue
        if made != text:
            write_text(path, made)
            changed.append(path)
    return changed, lacking
