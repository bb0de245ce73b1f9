"""The marks of pages, and what is put between them.

    <!-- reproduce: NAME -->  a block, see `blocks`
    <!-- measured: hierarchy bench tick -->  what a command prints
    <!-- measured: hierarchy bench resolvers --fresh 1 | EQ7, fresh .. Times of -->
    <!-- measured: table of hierarchy bench resolvers --seconds 0.2 -->
    <!-- kept: text of open-libraries-2026-11 | As often .. right: -->
    <!-- measured: hierarchy bench open | Fresh .. Public | without , (tight|slack) -->

all up to `<!-- end -->`. After each `|`, only the lines from one that starts with the first text to
the last before one that starts with the second; without those that the last expression is found
in. `table of`: in a
table whose columns are named after families and whose rows after resolvers, the cells are filled
with medians. `text of`: the paragraphs as they are. `kept`: a file of outputs that no command makes
again as it is.
"""

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Sequence
from itertools import dropwhile, takewhile
from pathlib import Path

from benchmark.reproduce.blocks import Stored, block, cell
from hierarchy.errors import HierarchyError, naming, refuse
from scenarios.files import make_folder, slug, write_text

ROOT = Path(__file__).parents[2]
OUTPUT = "docs/results/output"
_COLUMNS = "100"  # of the terminal that a command writes to
_CODE = ("hierarchy", "solvers", "scenarios", "benchmark")
_READ = (".py", ".toml", ".npz", ".png")  # scenarios, problems and frames make the numbers too
_MARK = re.compile(r"(?P<mark>^<!-- (?P<kind>reproduce|measured|kept): "
                   r"(?:(?P<form>table|text) of )?(?P<name>[^|\n]*?)"
                   r"(?P<ranges>(?: \| [^|\n]+? \.\. [^|\n]+?)*)"
                   r"(?: \| without (?P<without>[^\n]+?))? -->\n)"
                   r"(?P<text>.*?)(?P<end><!-- end -->)", re.DOTALL | re.MULTILINE)


class CommandError(RuntimeError):
    """A command ended with another exit code than 0."""


def marked(root: Path) -> list[str]:
    """Return the pages of a checkout that have marks, by their paths in it."""
    found = [root / "README.md", *sorted((root / "docs").rglob("*.md"))]
    return [path.relative_to(root).as_posix() for path in found if path.is_file() and _MARK.search(
        path.read_text("utf-8"))]


def commands(text: str) -> list[str]:
    """Return the commands of a page, each once."""
    return list(dict.fromkeys(found["name"] for found in _MARK.finditer(text)
                              if found["kind"] == "measured"))


def run(command: str, root: Path, out: Path) -> str:
    """Return what a command prints, run in the checkout `root`; raises CommandError.

    `out` stores it: the same code does not run the same command again.
    """
    code = hashlib.sha256()
    for path in sorted(path for folder in _CODE for path in (root / folder).rglob("*.*")
                       if path.suffix in _READ):
        code.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    folder = out / code.hexdigest()[:16] / slug(command)
    stored = folder / "output.txt"
    if not stored.is_file():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        write_text(stored, _printed(command, root, folder / "run"))
    return stored.read_text(encoding="utf-8")


def _printed(command: str, root: Path, out: Path) -> str:
    program, *arguments = shlex.split(command)
    line = [sys.executable, *arguments]
    if program == "hierarchy":
        line = [sys.executable, "-m", "scenarios.cli.start", *arguments, "--out", str(out)]
    done = subprocess.run(line, cwd=root, env=os.environ | {"COLUMNS": _COLUMNS}, text=True,
                          stdout=subprocess.PIPE, check=False)
    if done.returncode:
        raise CommandError(f"{command}: exit code {done.returncode}\n{done.stdout}")
    lines = [line.rstrip() for line in done.stdout.splitlines()
             if not line.startswith(("Numbers: ", "Page: "))]
    return "\n".join(lines).rstrip() + "\n"


def file_of(command: str, root: Path) -> Path:
    """Return the file that has what a command prints, or that is kept under a name."""
    return make_folder(root / OUTPUT) / f"{slug(command)}.txt"


def fill(root: Path, stored: Stored) -> tuple[list[Path], list[str]]:
    """Fill the pages of a checkout; return those that changed, and why others cannot be filled."""
    changed, lacking = [], []
    for name in marked(root):
        path = root / name
        text = path.read_text(encoding="utf-8")
        try:
            made = filled(text, root, name, stored)
        except HierarchyError as error:
            lacking.append(str(error))
            continue
        if made != text:
            write_text(path, made)
            changed.append(path)
    return changed, lacking


def filled(text: str, root: Path, page: str, stored: Stored) -> str:
    """Return a page with what is between its marks made anew.

    Raises HierarchyError, naming the page, for an unknown block, or an output that is missing
    or lacks the lines asked for.
    """
    def output(command: str) -> str:
        try:
            return file_of(command, root).read_text(encoding="utf-8")
        except FileNotFoundError:
            raise HierarchyError(f"no output of {command!r} is stored; run `hierarchy reproduce "
                                 f"{page}`") from None

    def made(found: re.Match[str]) -> str:
        name = found["name"]
        if found["kind"] == "reproduce":
            try:
                return f"{found['mark']}{block(name, stored, output).rstrip()}\n{found['end']}"
            except KeyError as error:
                raise HierarchyError(f"block {name!r}: there is no block or claim {error}"
                                     ) from None
        said = output(name)
        if found["form"] == "table":
            return f"{found['mark']}{_with_medians(found['text'], said)}{found['end']}"
        ranges = [one.split(" .. ") for one in found["ranges"].split(" | ")[1:]]
        part = [line for line in _part(said.splitlines(), ranges, f"the output of {name!r}")
                if not found["without"] or not re.search(found["without"], line)]
        inside = part if found["form"] == "text" else ["```", *part, "```"]
        return "\n".join([found["mark"].rstrip(), *inside, found["end"]])

    with naming(page, of=(ValueError, re.error)):
        return _MARK.sub(made, text)


def _part(lines: list[str], ranges: Sequence[Sequence[str]], where: str) -> list[str]:
    """Return the lines from one that starts as a range does to one that starts as its end does."""
    parts = [_between(lines, first, last) for first, last in ranges] or [lines]
    for (first, _), part in zip(ranges, parts, strict=False):
        refuse(not part, f"{where} has no line that starts with {first!r}")
    return "\n\n".join("\n".join(part).rstrip() for part in parts).splitlines()


def _between(lines: list[str], first: str, last: str) -> list[str]:
    below = dropwhile(lambda line: not line.startswith(first), lines)
    return list(takewhile(lambda line: not line.startswith(last), below))


def _with_medians(table: str, said: str) -> str:
    """Return a table of a page with new medians [us] in the columns named after families.

    `said` has a table for each family, below its name, whose rows begin with a name and the median.
    """
    head, rule, *rows = [line for line in table.splitlines() if line]
    families = [heading.strip().split(" ")[0] for heading in _cells(head)]
    made = [head, rule]
    for row in rows:
        cells = _cells(row)
        name = re.sub(r'[`,"]|form = ', "", cells[0]).strip()
        for c, family in enumerate(families):
            if family and family in said.splitlines():
                cells[c] = f" {_median(said, family, {'hqp': 'hqp proxqp'}.get(name, name))} "
        made.append(f"|{'|'.join(cells)}|")
    return "\n".join(made) + "\n"


def _median(said: str, family: str, name: str) -> str:
    try:
        median = float(cell(said, {"table": family, "row": name, "place": "1"}))
    except ValueError:  # no such row, or it has a dash there
        return "–"
    return f"{median:.0f}" if median >= 10.0 else f"{median:.1f}"


def _cells(row: str) -> list[str]:
    return row.strip().strip("|").split("|")
