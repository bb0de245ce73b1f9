"""Write the results of `hierarchy bench open` into the documents.

    python -m benchmark.studies.open_report --runs runs/open [PAGE ...]

A page says between which marks a part belongs, `<!-- open benchmark: NAME -->` up to
`<!-- end of open benchmark -->`; PARTS has the names. The figures of the fresh set go to
docs/images/. Everything is judged anew from the raw rows.
"""

from __future__ import annotations

import argparse
import io
import re
from collections.abc import Callable
from pathlib import Path
from textwrap import fill
from typing import NamedTuple

import numpy as np
from rich.console import Console

from benchmark.report import Section
from benchmark.solve import views
from benchmark.solve.open import Half, halves, report
from benchmark.store import Store
from hierarchy.words import listed
from scenarios.draw.figures.drawing import write
from scenarios.problems.families import FAMILIES

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "CHANGELOG.md", "docs/benchmarks.md", "docs/benchmark-report.md")
WIDTH = 100
BLOCK = re.compile(r"(?P<mark><!-- open benchmark: (?P<name>[a-z ]+) -->\n).*?"
                   r"(?P<end><!-- end of open benchmark -->)", re.DOTALL)


class Found(NamedTuple):
    """What a folder has: its sets, fresh ones first, and the section of each."""

    store: Store
    halves: list[Half]
    sections: list[Section]


def filled(text: str, found: Found) -> str:
    """Return a page with its blocks made anew; raises KeyError for an unknown name."""
    return BLOCK.sub(lambda block: f"{block['mark']}{PARTS[block['name']](found)}\n{block['end']}",
                     text)


def _items(lines: list[str]) -> str:
    return "\n".join(fill(f"- {line}", WIDTH, subsequent_indent="  ") for line in lines)


def _tables(which: int, first: int, last: int) -> Callable[[Found], str]:
    """Return a maker of a block of code with some tables of a set."""
    def made(found: Found) -> str:
        console = Console(file=io.StringIO(), width=WIDTH, highlight=False, markup=False)
        for table in found.sections[which].tables[first:last]:
            console.print(table.title, table.rich(), "", sep="\n")
        lines = console.file.getvalue().rstrip().splitlines()  # type: ignore[attr-defined]
        return "\n".join(["```", *(line.rstrip() for line in lines), "```"])

    return made


def problems(found: Found) -> str:
    """Return a table of the families: problems, sizes, and what is proved of them."""
    rows = ["| family | problems | unknowns | rows | proved | ill-posed | what |",
            "|---|---|---|---|---|---|---|"]
    for name in found.halves[0].collections:
        own = [half.collections[name] for half in found.halves if name in half.collections]
        every = [(h, proof) for one in own
                 for h, proof in zip(one.problems, one.answers or (), strict=True)]
        posed = sum(proof.posed <= len(h.sizes) for h, proof in every)
        rows.append(f"| {name} | {' + '.join(str(len(one.problems)) for one in own)} "
                    f"| {between([h.n for h, _ in every])} | {between([h.m for h, _ in every])} "
                    f"| {sum(proof.complete for _, proof in every)} | {posed} "
                    f"| {own[0].head.what} |")
    absent = [name for name in FAMILIES if name not in found.halves[0].collections]
    return "\n".join([*rows, *(["", f"Not in this run: {listed(absent)}."] if absent else [])])


def between(values: list[int]) -> str:
    """Return the range of numbers."""
    return str(min(values)) if min(values) == max(values) else f"{min(values)} to {max(values)}"


def entrants(found: Found) -> str:
    """Return the entrants with versions and limits."""
    limits = found.store.notes("limits")
    versions = {row["entrant"]: row["version"] for half in found.halves for row in half.rows}
    rows = [f"| {label} | {version} | {limits.get(label, '')} |"
            for label, version in versions.items()]
    missing = [f"| {label} | missing: {why} | |"
               for label, why in found.store.notes("missing").items()]
    return "\n".join(["| entrant | version | known limits |", "|---|---|---|", *rows, *missing])


def machine(found: Found) -> str:
    """Return the machine, its packages, and how busy it was."""
    known = found.store.notes("machine")
    first = ("processor", "cores", "system", "python")
    packages = ", ".join(f"{name} {version}" for name, version in known.items()
                         if name not in first)
    work = np.array([row["yardstick_ns"] for half in found.halves for row in half.rows
                     if row.get("yardstick_ns")]) / 1e3
    return fill(f"{known['processor']}, {known['cores']} cores, {known['system']}, Python "
                f"{known['python']}, {packages}. The yardstick took a median of "
                f"{np.median(work):.0f} us, in the slowest file of an entrant "
                f"{work.max() / np.median(work):.1f} times that.", WIDTH)


PARTS: dict[str, Callable[[Found], str]] = {
    "lead": lambda found: _items([*found.sections[0].lead]),
    "short": lambda found: _items([" ".join(found.sections[0].lead)]),
    "problems": problems, "entrants": entrants, "machine": machine,
    "notes": lambda _: fill(views.NOTES, WIDTH), "fresh answers": _tables(0, 0, 2),
    "fresh times": _tables(0, 2, 3), "fresh inside": _tables(0, 3, 4),
    "public answers": _tables(-1, 0, 2), "public times": _tables(-1, 2, 3)}
"""Makers of the blocks by name."""


def main() -> None:
    """Fill the pages and draw the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=Path, default=ROOT / "runs" / "open",
                        help="folder of `hierarchy bench open`")
    parser.add_argument("pages", nargs="*", default=PAGES, help="pages, relative to the checkout")
    options = parser.parse_args()
    store = Store(options.runs)
    sets = halves(store)
    found = Found(store, sets, list(report(store, WIDTH).sections)[:len(sets)])
    for page in options.pages:
        path = ROOT / page
        path.write_text(filled(path.read_text(encoding="utf-8"), found), encoding="utf-8")
    for name, figure in zip(("profiles", "misses", "heat"), found.sections[0].figures.values(),
                            strict=True):
        write(figure, str(ROOT / "docs" / "images" / f"open-{name}"))
        (ROOT / "docs" / "images" / f"open-{name}.svg").unlink(missing_ok=True)


if __name__ == "__main__":
    main()
