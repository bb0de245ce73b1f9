"""Write the results of `hierarchy bench open` into the documents.

    python docs/studies/open_report.py --runs runs/open [PAGE ...]

A page says between which marks a part belongs, `<!-- open benchmark: NAME -->` up to
`<!-- end of open benchmark -->`; PARTS has the names. The figures of the fresh half go to
docs/images/. Everything is judged anew from the raw rows.
"""

from __future__ import annotations

import argparse
import io
import re
from collections.abc import Callable
from pathlib import Path
from textwrap import fill

import numpy as np
from rich.console import Console
from rich.table import Table

from hierarchy.words import listed
from scenarios.bench.open import figures
from scenarios.bench.open.families import FAMILIES
from scenarios.bench.open.page import first_lines, lead
from scenarios.bench.open.printing import NOTES, answers, insides, sizes, times
from scenarios.bench.open.results import Half, Results, results
from scenarios.draw.figures.drawing import write

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "CHANGELOG.md", "docs/benchmarks.md", "docs/benchmark-report.md")
WIDTH = 100
BLOCK = re.compile(r"(?P<mark><!-- open benchmark: (?P<name>[a-z ]+) -->\n).*?"
                   r"(?P<end><!-- end of open benchmark -->)", re.DOTALL)


def main() -> None:
    """Fill the pages and draw the figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=Path, default=ROOT / "runs" / "open",
                        help="folder of `hierarchy bench open`")
    parser.add_argument("pages", nargs="*", default=PAGES, help="pages, relative to the checkout")
    options = parser.parse_args()
    found = results(options.runs)
    for page in options.pages:
        path = ROOT / page
        path.write_text(filled(path.read_text(encoding="utf-8"), found), encoding="utf-8")
    images = ROOT / "docs" / "images"
    half = fresh(found)
    for name, drawn in (("profiles", figures.profiles(half, legend=True)),
                        ("misses", figures.time_against_miss(half, legend=True)),
                        ("heat", figures.heat(half))):
        write(drawn, str(images / f"open-{name}"))
        (images / f"open-{name}.svg").unlink(missing_ok=True)


def filled(text: str, found: Results) -> str:
    """Return a page with its blocks made anew; raises KeyError for an unknown name."""
    return BLOCK.sub(lambda block: f"{block['mark']}{PARTS[block['name']](found)}\n{block['end']}",
                     text)


def fresh(found: Results) -> Half:
    """Return the first half, which is fresh if there is a fresh one."""
    return found.halves[0]


def public(found: Results) -> Half:
    """Return the last half, the public one."""
    return found.halves[-1]


def sentences(found: Results) -> str:
    """Return what the fresh half shows, as a list."""
    return "\n".join(fill(f"- {line}", WIDTH, subsequent_indent="  ")
                     for line in lead(fresh(found)))


def short(found: Results) -> str:
    """Return who is right most often, and where others are better, as one item of a list."""
    return fill("- " + " ".join(first_lines(fresh(found))), WIDTH, subsequent_indent="  ")


def text(*tables: Table) -> str:
    """Return tables as a block of code."""
    console = Console(file=io.StringIO(), width=WIDTH, highlight=False, markup=False)
    for table in tables:
        console.print(table, "", sep="\n")
    lines = console.file.getvalue().rstrip().splitlines()  # type: ignore[attr-defined]
    return "\n".join(["```", *(line.rstrip() for line in lines), "```"])


def problems(found: Results) -> str:
    """Return a table of the families: problems, sizes, and what is proved of them."""
    rows = ["| family | problems | unknowns | rows | proved | ill-posed | what |",
            "|---|---|---|---|---|---|---|"]
    for name in fresh(found).families:
        halves = [half.collections[name] for half in found.halves if name in half.collections]
        every = [h for one in halves for h in one.problems]
        proofs = [proof for one in halves for proof in one.answers or ()]
        posed = sum(proof.posed <= len(h.sizes) for proof, h in zip(proofs, every, strict=True))
        rows.append(f"| {name} | {' + '.join(str(len(one.problems)) for one in halves)} "
                    f"| {between([h.n for h in every])} | {between([h.m for h in every])} "
                    f"| {sum(proof.complete for proof in proofs)} | {posed} "
                    f"| {halves[0].head.what} |")
    absent = [name for name in FAMILIES if name not in fresh(found).families]
    return "\n".join([*rows, *(["", f"Not in this run: {listed(absent)}."] if absent else [])])


def between(values: list[int]) -> str:
    """Return the range of numbers."""
    return str(min(values)) if min(values) == max(values) else f"{min(values)} to {max(values)}"


def entrants(found: Results) -> str:
    """Return the entrants with versions and limits."""
    labels = dict.fromkeys(label for half in found.halves for label in half.entrants)
    rows = [f"| {label} | {found.version(label)} | {found.limits.get(label, '')} |"
            for label in labels]
    missing = [f"| {label} | missing: {why} | |" for label, why in found.missing.items()]
    return "\n".join(["| entrant | version | known limits |", "|---|---|---|", *rows, *missing])


def machine(found: Results) -> str:
    """Return the machine, its packages, and how busy it was."""
    packages = ", ".join(f"{name} {version}" for name, version in found.machine.items()
                         if name not in ("processor", "cores", "system", "python"))
    work = np.array([row.yardstick for half in found.halves for row in half.rows
                     if row.yardstick]) / 1e3
    about = [found.machine["processor"], f"{found.machine['cores']} cores",
             found.machine["system"], f"Python {found.machine['python']}", packages]
    said = (f"{', '.join(about)}. The yardstick took a median of {np.median(work):.0f} us, in the "
            f"slowest file of an entrant {work.max() / np.median(work):.1f} times that.")
    return fill(said, WIDTH)


PARTS: dict[str, Callable[[Results], str]] = {
    "lead": sentences, "short": short, "problems": problems, "entrants": entrants,
    "machine": machine,
    "notes": lambda _: fill(NOTES, WIDTH),
    "fresh answers": lambda found: text(answers(fresh(found)), sizes(fresh(found))),
    "fresh times": lambda found: text(times(fresh(found), WIDTH)),
    "fresh inside": lambda found: text(*insides(fresh(found), WIDTH)),
    "public answers": lambda found: text(answers(public(found)), sizes(public(found))),
    "public times": lambda found: text(times(public(found), WIDTH))}
"""Makers of the blocks by name."""


if __name__ == "__main__":
    main()
