"""Run the commands behind the timings in the documents, and write what they print into the pages.

    python docs/studies/measured.py --out runs/measured [PAGE ...]

A page says between which marks a command's output belongs:

    <!-- measured: hierarchy bench tick -->
    <!-- measured: hierarchy bench resolvers --fresh 1 | EQ7, fresh .. Times of -->
    <!-- measured: table of hierarchy bench resolvers --seconds 0.2 -->

each up to `<!-- end of measurement -->`. After `|`, only the lines from one that starts with the
first text to the last before one that starts with the second. `table of`: in a table whose columns
are named after families and whose rows after resolvers, the cells are filled with medians. Each
command runs once, one after the other: nothing else should run on the machine. Output that is in
the folder already is used again.
"""

from __future__ import annotations

import argparse
import csv
import os
import re
import shlex
import subprocess
import sys
from itertools import dropwhile, takewhile
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = ("README.md", "docs/benchmarks.md", "docs/choosing.md", "docs/batch.md",
         "docs/tpm-limits.md", "docs/first-paper.md", "docs/letter.md")
BLOCK = re.compile(r"(?P<mark><!-- measured: (?P<table>table of )?(?P<command>[^|\n]*?)"
                   r"(?: \| (?P<first>[^\n]+?) \.\. (?P<last>[^\n]+?))? -->\n)"
                   r"(?P<text>.*?)(?P<end><!-- end of measurement -->)", re.DOTALL)


def main() -> None:
    """Run the commands of the pages and fill them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "runs" / "measured",
                        help="folder for what the commands print and write")
    parser.add_argument("pages", nargs="*", default=PAGES, help="pages, relative to the checkout")
    options = parser.parse_args()
    for page in options.pages:
        path = ROOT / page
        text = path.read_text(encoding="utf-8")
        path.write_text(BLOCK.sub(lambda block: _filled(block, options.out), text),
                        encoding="utf-8")


def _filled(block: re.Match[str], out: Path) -> str:
    folder = _run(block["command"], out)
    if block["table"]:
        inside = _with_medians(block["text"], folder / "run" / "resolvers.csv")
    else:
        lines = (folder / "output.txt").read_text(encoding="utf-8").splitlines()
        inside = "```\n" + "\n".join(_part(lines, block["first"], block["last"])) + "\n```\n"
    return block["mark"] + inside + block["end"]


def _run(command: str, out: Path) -> Path:
    """Run a command unless its output is there; return its folder."""
    folder = out / re.sub(r"\W+", "-", command)
    if (folder / "output.txt").is_file():
        return folder
    folder.mkdir(parents=True, exist_ok=True)
    program, *arguments = shlex.split(command)
    line = [sys.executable, *arguments]
    if program == "hierarchy":
        line = [str(Path(sys.executable).with_name(program)), *arguments, "--out",
                str(folder / "run")]
    print(f"{command} ...", flush=True)
    done = subprocess.run(line, cwd=ROOT, env=os.environ | {"COLUMNS": "100"}, text=True,
                          stdout=subprocess.PIPE, check=False)
    if done.returncode:
        sys.exit(f"{command}: exit code {done.returncode}\n{done.stdout}")
    (folder / "output.txt").write_text(done.stdout, encoding="utf-8")
    return folder


def _part(lines: list[str], first: str | None, last: str | None) -> list[str]:
    if first and last:
        lines = list(dropwhile(lambda line: not line.startswith(first), lines))
        lines = list(takewhile(lambda line: not line.startswith(last), lines))
        if not lines:
            sys.exit(f"no line of the output starts with {first!r}")
    lines = [line.rstrip() for line in lines if not line.startswith("Numbers: ")]
    while lines and not lines[-1]:
        lines.pop()
    return lines


def _with_medians(table: str, path: Path) -> str:
    """Return a table of a page with new medians [us] in the columns named after families."""
    with path.open(encoding="utf-8", newline="") as file:
        medians = {(row["family"], row["resolver"]): float(row["median_us"])
                   for row in csv.DictReader(file) if row["origin"] == "known"}
    families = {family for family, _ in medians}
    head, rule, *rows = [line for line in table.splitlines() if line]
    columns = [heading.strip().split(" ")[0] for heading in _cells(head)]
    made = [head, rule]
    for row in rows:
        cells = _cells(row)
        for c, family in enumerate(columns):
            if family in families:
                median = medians.get((family, _entrant(cells[0])))
                cells[c] = " – " if median is None else f" {_digits(median)} "
        made.append(f"|{'|'.join(cells)}|")
    return "\n".join(made) + "\n"


def _cells(row: str) -> list[str]:
    return row.strip().strip("|").split("|")


def _entrant(cell: str) -> str:
    """Return the name in the table of the benchmark for the first cell of a row."""
    name = re.sub(r'[`,"]|form = ', "", cell).strip()
    return {"hqp": "hqp proxqp"}.get(name, name)


def _digits(median: float) -> str:
    return f"{median:.0f}" if median >= 10.0 else f"{median:.1f}"


if __name__ == "__main__":
    main()
