"""The blocks of the documents: claims, what was found about them, sentences with numbers."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import dropwhile, takewhile
from pathlib import Path
from textwrap import fill
from typing import Any

from benchmark.reproduce import claims, fronts, protocol
from benchmark.reproduce.fronts import Point
from benchmark.reproduce.protocol import PROTOCOL, Rows
from benchmark.reproduce.verdicts import Found, judged, shown
from hierarchy.errors import HierarchyError
from scenarios.measure.statistics import probability

ITEMS: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["block"]
"""Sentences by the name of their block; see blocks.toml."""

ROWS, POINTS = "docs/results/protocol.json.gz", "docs/results/fronts.json"
FAMILIES = ("letter", "own")
_WIDTH = 100     # columns of a page
_NOTHING = "Not run yet: `hierarchy reproduce protocol`."
_CLAIM = re.compile(r"\{(?P<name>[\w-]+)\}")
_CELL = re.compile(r"\{(?P<output>[^{}/]+)/(?P<table>[^{}/]+)/(?P<row>[^{}/]+)/(?P<place>\d+)\}")


@dataclass(frozen=True)
class Stored:
    """What runs have left in docs/results: the rows of the protocol, and the points of fronts."""

    rows: Rows | None
    points: list[Point]

    @classmethod
    def read(cls, root: Path) -> Stored:
        """Return what a checkout has stored."""
        rows, points = root / ROWS, root / POINTS
        return cls(protocol.read(rows) if rows.is_file() else None,
                   fronts.read(points) if points.is_file() else [])


def block(name: str, stored: Stored, output: Callable[[str], str]) -> str:
    """Return the Markdown of a block; raises KeyError for an unknown block or claim.

    output : returns what a command has printed.
    """
    rows = stored.rows
    if name in ITEMS:
        return "\n".join(fill(f"- {text}", _WIDTH, subsequent_indent="  ")
                         for text in _items(ITEMS[name], rows, output))
    if name == "untested":
        return "\n".join(claims.untested(PROTOCOL))
    what, _, of = name.partition("-")
    known = {"asked": ("letter",), "found": FAMILIES, "front": fronts.FRONTS, "faults": ("",)}
    if of not in known[what]:
        raise KeyError(name)
    if what == "asked":
        return "\n".join(claims.asked(PROTOCOL))
    if what == "front":
        return "\n".join(fronts.table(stored.points, of))
    if rows is None:
        return _NOTHING
    return "\n".join(claims.faults(PROTOCOL, rows) if what == "faults" else
                     claims.found(PROTOCOL, rows, of))


def _items(given: Mapping[str, Any], rows: Rows | None, output: Callable[[str], str]) -> list[str]:
    outputs = given.get("outputs", {})
    texts = [_CELL.sub(lambda found: cell(output(outputs[found["output"]]), found.groupdict()),
                       item) for item in given["items"]]
    if not any(_CLAIM.search(text) for text in texts):
        return texts
    if rows is None:
        return [_NOTHING]
    known = {one.claim.name: said(one, rows) for one in every(rows)}
    known["progress"] = claims.progress(PROTOCOL, rows)
    return [_CLAIM.sub(lambda named: known[named["name"]], text) for text in texts]


def every(rows: Rows) -> list[Found]:
    """Return what was found about every claim."""
    return [one for family in FAMILIES for one in judged(PROTOCOL, rows, family)]


def said(found: Found, rows: Rows) -> str:
    """Return an effect, its interval, its p-value and the verdict, as they stand in a sentence."""
    effect = shown(found.claim, rows, found.effect)
    return f"{effect}, {probability(found.p)}: {found.decided}"


def cell(output: str, asked: Mapping[str, str]) -> str:
    """Return a number that was printed: that at `place`, from 1, after the name of a row.

    The table begins with the line that starts as `table` does, and ends at an empty one. Of rows
    whose names begin alike, the shortest name counts, that of the row with the fewest words.
    """
    below = dropwhile(lambda line: not line.startswith(asked["table"]), output.splitlines())
    lines = [re.sub("[│|]", " ", line).strip() for line in takewhile(str.strip, below)]
    found = [line[len(asked["row"]):].split() for line in lines
             if line.startswith(f"{asked['row']} ")]
    if not found:
        raise HierarchyError(f"the output has no row {asked['row']!r} below {asked['table']!r}")
    return min(found, key=len)[int(asked["place"]) - 1]
