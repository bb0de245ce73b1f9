"""The blocks of the documents: claims, what was found about them, sentences with numbers."""

import json
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import dropwhile, takewhile
from pathlib import Path
from textwrap import fill
from typing import Any, Self

from benchmark.reproduce import fronts, protocol
from benchmark.reproduce.fronts import Point
from benchmark.reproduce.protocol import PROTOCOL, Claim, Rows
from benchmark.reproduce.verdicts import DIFFERS, UNDECIDED, Found, judged, shown
from hierarchy.errors import refuse
from scenarios.measure.statistics import probability

ITEMS: Mapping[str, Mapping[str, Any]] = tomllib.loads(
    Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["block"]
"""Sentences by the name of their block; see blocks.toml."""

ROWS, POINTS = "docs/results/protocol.json.gz", "docs/results/fronts.json"
FAMILIES = ("letter", "own")
_WIDTH = 100     # columns of a page
_CLEAR = 0.001   # p-value below which a table does not say it
_NOTHING = "Not run yet: `hierarchy reproduce protocol`."
_CLAIM = re.compile(r"\{(?P<name>[\w-]+)\}")
_CELL = re.compile(r"\{(?P<output>[^{}/]+)/(?P<table>[^{}/]+)/(?P<row>[^{}/]+)/(?P<place>\d+)\}")


@dataclass(frozen=True)
class Stored:
    """What runs have left in docs/results: the rows of the protocol, and the points of fronts."""

    rows: Rows | None
    points: list[Point]

    @classmethod
    def read(cls, root: Path) -> Self:
        """Return what a checkout has stored."""
        rows, points = root / ROWS, root / POINTS
        return cls(protocol.read(rows) if rows.is_file() else None,
                   [Point(**one) for one in json.loads(points.read_text(encoding="utf-8"))]
                   if points.is_file() else [])


def block(name: str, stored: Stored, output: Callable[[str], str]) -> str:
    """Return the Markdown of a block; raises KeyError for an unknown block or claim.

    output : returns what a command has printed.
    """
    rows = stored.rows
    known: dict[str, Callable[[], list[str]]] = {
        "asked-letter": partial(_asked, rows), "untested": _untested,
        **{one: partial(_items, given, rows, output) for one, given in ITEMS.items()},
        **{f"front-{one}": partial(fronts.table, stored.points, one) for one in fronts.FRONTS}}
    of_rows: dict[str, Callable[[Rows], list[str]]] = {
        "faults": _faults, **{f"found-{one}": partial(_found, family=one) for one in FAMILIES}}
    if name in known:
        return "\n".join(known[name]())
    return "\n".join(of_rows[name](rows)) if rows is not None else _NOTHING


def _item(text: str) -> str:
    """Return an entry of a list; names in backticks are not broken at hyphens."""
    return fill(f"- {text}", _WIDTH, subsequent_indent="  ", break_on_hyphens=False,
                break_long_words=False)


def _items(given: Mapping[str, Any], rows: Rows | None, output: Callable[[str], str]) -> list[str]:
    outputs = given.get("outputs", {})
    texts = [_CELL.sub(lambda found: cell(output(outputs[found["output"]]), found.groupdict()),
                       item) for item in given["items"]]
    if any(_CLAIM.search(text) for text in texts):
        if rows is None:
            return [_item(_NOTHING)]
        known = {one.claim.name: said(one, rows) for one in every(rows)}
        known["progress"] = _progress(rows)
        texts = [_CLAIM.sub(lambda named: known[named["name"]], text) for text in texts]
    return [_item(text) for text in texts]


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
    found = [line[len(asked["row"]):].split() for line in takewhile(str.strip, below)
             if line.startswith(f"{asked['row']} ")]
    refuse(not found, f"the output has no row {asked['row']!r} below {asked['table']!r}")
    row, place = min(found, key=len), int(asked["place"])
    refuse(len(row) < place, f"row {asked['row']!r} below {asked['table']!r} of the output has no "
           f"number {place}")
    return row[place - 1]


def _asked(rows: Rows | None) -> list[str]:
    """Return the quotations, and below each what decides it."""
    decided: dict[str, list[str]] = {}
    for one in PROTOCOL.claims:
        if one.family == "letter":
            unit = rows.metrics[one.metric]["unit"] if rows and one.metric else ""
            unit = unit.replace("share", "of the time")
            decided.setdefault(f"{one.section}: “{one.quotation}”: ", []).append(
                f"{_decider(one, unit)}, {_least(one, unit)}")
    return [_item(said + "; ".join(decides)) for said, decides in decided.items()]


def _untested() -> list[str]:
    """Return the letter's claims that runs do not decide, with the reason."""
    parts = [(*said.removesuffix(")").rsplit(" (", 1), why)
             for said, why in PROTOCOL.untested.items()]
    return [_item(f"{section}: “{quotation}”: {why}.") for quotation, section, why in parts]


def _found(rows: Rows, family: str) -> list[str]:
    """Return a table of what was found about the claims of a family; of each layout if unclear."""
    lines = [f"| claim | effect [95 % interval] ({', '.join(rows.layouts)}) | verdict |",
             "|---|---|---|"]
    for one in judged(PROTOCOL, rows, family):
        each = ", ".join(shown(one.claim, rows, effect).partition(" [")[0]
                         for effect in one.layouts)
        each = f" ({each})" if one.decided.startswith((DIFFERS, UNDECIDED)) else ""
        p = f", {probability(one.p)}" if one.p >= _CLEAR else ""
        lines.append(f"| {one.claim.text} | {shown(one.claim, rows, one.effect)}{each} | "
                     f"{one.decided}{p} |")
    return lines


def _progress(rows: Rows) -> str:
    """Return how much of the protocol has been run."""
    arms = f"starts on each of {len(rows.layouts)} arms, without and with noise."
    if len(rows.seeds) == len(PROTOCOL.seeds) and rows.starts == PROTOCOL.starts:
        return f"{len(rows.seeds)} seeds, {rows.starts} {arms}"
    return (f"Run so far: {len(rows.seeds)} of {len(PROTOCOL.seeds)} seeds, {rows.starts} of "
            f"{PROTOCOL.starts} {arms} *Undecided* can change with more.")


def _faults(rows: Rows) -> list[str]:
    """Return how much of the protocol has been run, and which columns have runs with a fault."""
    total, found = rows.blocks.size, dict[str, list[str]]()
    for column, reasons in rows.reasons[0].items():
        why = "; ".join(reason.partition(":")[0] for reason in reasons)
        found.setdefault(why, []).append(f"`{column}` {total - int(rows.ended(column).sum())}")
    said = [f"{', '.join(columns)} ({why})" for why, columns in found.items()]
    return [f"{_progress(rows)} Faults in {total} runs: {', '.join(said) or 'none'}."]


def _decider(claim: Claim, unit: str) -> str:
    if not claim.metric:
        return f"share of runs of `{claim.of}` that reach their end"
    if claim.rival:
        word = "below" if claim.below else "above"
        return f"`{claim.metric}` of `{claim.of}` {word} that of `{claim.rival}`"
    bound = f"at least {claim.least:g}" if claim.most == float("inf") else f"at most {claim.most:g}"
    return f"`{claim.metric}` of `{claim.of}` {bound} {unit}"


def _least(claim: Claim, unit: str) -> str:
    if not claim.rival:
        return f"{100 * PROTOCOL.share:g} % of starts"
    return f"{claim.matters:g} {'%' if claim.percent else unit}".strip()
