"""Commands whose output stands in the documents: run, kept as text, put into the pages.

A page says between which marks a command's output belongs:

    <!-- measured: hierarchy bench tick -->
    <!-- measured: hierarchy bench resolvers --fresh 1 | EQ7, fresh .. Times of -->
    <!-- measured: table of hierarchy bench resolvers --seconds 0.2 -->

each up to `<!-- end of measurement -->`. After `|`, only the lines from one that starts with the
first text to the last before one that starts with the second. `table of`: in a table whose columns
are named after families and whose rows after resolvers, the cells are filled with medians.
"""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from itertools import dropwhile, takewhile
from pathlib import Path

from hierarchy.errors import HierarchyError
from scenarios.files import slug, write_text

PAGES = ("README.md", "docs/benchmarks.md", "docs/choosing.md", "docs/batch.md",
         "docs/tpm-limits.md", "docs/first-paper.md", "docs/letter.md", "docs/deploy.md",
         "docs/peers.md", "docs/standing.md", "docs/robots.md", "docs/ik.md")
OUTPUT = "docs/results/output"
_COLUMNS = "100"  # of the terminal that a command writes to
_BLOCK = re.compile(r"(?P<mark><!-- measured: (?P<table>table of )?(?P<command>[^|\n]*?)"
                    r"(?: \| (?P<first>[^\n]+?) \.\. (?P<last>[^\n]+?))? -->\n)"
                    r"(?P<text>.*?)(?P<end><!-- end of measurement -->)", re.DOTALL)
_MEDIAN = re.compile(r"(?P<name>\S+(?: \S+)*?)\s+(?P<median>\d[\d.]*)\s")


class CommandError(RuntimeError):
    """A command ended with another exit code than 0."""


def commands(text: str) -> list[str]:
    """Return the commands of a page, each once."""
    return list(dict.fromkeys(block["command"] for block in _BLOCK.finditer(text)))


def run(command: str, root: Path, out: Path) -> str:
    """Return what a command prints, run in the checkout `root`; raises CommandError.

    `out` keeps it: the same code does not run the same command again.
    """
    folder = out / _code(root) / slug(command)
    kept = folder / "output.txt"
    if not kept.is_file():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        write_text(kept, _printed(command, root, folder / "run"))
    return kept.read_text(encoding="utf-8")


def _printed(command: str, root: Path, out: Path) -> str:
    program, *arguments = shlex.split(command)
    line = [sys.executable, *arguments]
    if program == "hierarchy":
        line = [sys.executable, "-m", "scenarios.cli.main", *arguments, "--out", str(out)]
    done = subprocess.run(line, cwd=root, env=os.environ | {"COLUMNS": _COLUMNS}, text=True,
                          stdout=subprocess.PIPE, check=False)
    if done.returncode:
        raise CommandError(f"{command}: exit code {done.returncode}\n{done.stdout}")
    lines = [line.rstrip() for line in done.stdout.splitlines()
             if not line.startswith("Numbers: ")]
    return "\n".join(lines).rstrip() + "\n"


def _code(root: Path) -> str:
    """Return a digest of the code that a command may run."""
    found = hashlib.sha256()
    for folder in ("hierarchy", "solvers", "scenarios", "docs/studies"):
        for path in sorted((root / folder).rglob("*.py")):
            found.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return found.hexdigest()[:16]


def keep(outputs: Mapping[str, str], root: Path) -> list[Path]:
    """Write outputs beside the documents of a checkout, and return their files."""
    paths = [file_of(command, root) for command in outputs]
    for path, text in zip(paths, outputs.values(), strict=True):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_text(path, text)
    return paths


def file_of(command: str, root: Path) -> Path:
    """Return the file that keeps what a command prints."""
    return root / OUTPUT / f"{slug(command)}.txt"


def filled(text: str, root: Path, page: str) -> str:
    """Return a page with its blocks made from the outputs that are kept.

    Raises HierarchyError, naming the page, if one is missing or lacks the lines asked for.
    """
    def made(block: re.Match[str]) -> str:
        try:
            output = file_of(block["command"], root).read_text(encoding="utf-8")
        except FileNotFoundError:
            raise HierarchyError(f"{page}: no output of {block['command']!r} is kept; run "
                                 f"`hierarchy reproduce {page}`") from None
        if block["table"]:
            inside = _with_medians(block["text"], medians(output))
        else:
            part = _part(output.splitlines(), block["first"], block["last"])
            if not part:
                raise HierarchyError(f"{page}: no line of the output of {block['command']!r} "
                                     f"starts with {block['first']!r}")
            inside = "\n".join(["```", *part, "```\n"])
        return f"{block['mark']}{inside}{block['end']}"

    return _BLOCK.sub(made, text)


def _part(lines: list[str], first: str | None, last: str | None) -> list[str]:
    """Return the lines from one that starts with `first` to one that starts with `last`."""
    if first and last:
        lines = list(dropwhile(lambda line: not line.startswith(first), lines))
        lines = list(takewhile(lambda line: not line.startswith(last), lines))
    while lines and not lines[-1]:
        lines.pop()
    return lines


def medians(output: str) -> dict[tuple[str, str], float]:
    """Return the medians [us] that `hierarchy bench resolvers` printed, by family and name.

    A family is a line of its own; the rows of its table begin with a name and the median.
    """
    found, family, before = {}, "", ""
    for line in output.splitlines():
        if line.split()[:1] == ["median"]:
            family = before
        elif (row := _MEDIAN.match(line)) and family:
            found[family, row["name"]] = float(row["median"])
        before = line
    return found


def _with_medians(table: str, found: Mapping[tuple[str, str], float]) -> str:
    """Return a table of a page with new medians [us] in the columns named after families."""
    families = {family for family, _ in found}
    head, rule, *rows = [line for line in table.splitlines() if line]
    columns = [heading.strip().split(" ")[0] for heading in _cells(head)]
    made = [head, rule]
    for row in rows:
        cells = _cells(row)
        for c, family in enumerate(columns):
            if family in families:
                median = found.get((family, _name(cells[0])))
                cells[c] = " – " if median is None else f" {_digits(median)} "
        made.append(f"|{'|'.join(cells)}|")
    return "\n".join(made) + "\n"


def _cells(row: str) -> list[str]:
    return row.strip().strip("|").split("|")


def _name(cell: str) -> str:
    """Return the name in the table of the benchmark for the first cell of a row."""
    name = re.sub(r'[`,"]|form = ', "", cell).strip()
    return {"hqp": "hqp proxqp"}.get(name, name)


def _digits(median: float) -> str:
    return f"{median:.0f}" if median >= 10.0 else f"{median:.1f}"
