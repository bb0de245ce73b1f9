"""What a benchmark found: tables, figures and words, printed, as CSV, and as one HTML page.

A column of a table says how its cells are written.
"""

import csv
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import isnan
from pathlib import Path
from typing import Any, NamedTuple, final

from matplotlib.figure import Figure
from rich.console import Console
from rich.table import Table as Rich

from benchmark.timing import machine
from scenarios.draw.figures import drawing
from scenarios.files import make_folder, named, slug, write_json, write_text, written
from scenarios.templates import filled, resource

Row = dict[str, Any]
NONE = "–"


def _known(form: Callable[[Any], str]) -> Callable[[Any], str]:
    """Return a form of values that writes what is not known as a dash."""
    return lambda value: (NONE if value is None or (isinstance(value, float) and isnan(value))
                          else form(value))


text = _known(str)
"""Words, in a column whose lines are broken."""
whole = _known("{:.0f}".format)
"""A number without decimals."""
power = _known("{:.0e}".format)
"""A size, as 1e-09."""
short = _known(lambda value: f"{value:.{int(value < 10.0)}f}")
"""A number with one decimal, or all digits before the decimal point."""
digits = _known(lambda value: f"{value:.{2 - (value >= 10.0) - (value >= 100.0)}f}")
"""A number with three digits, or all digits before the decimal point."""
yes = _known(lambda value: "yes" if value else "no")
"""Yes or no."""
percent = _known(lambda value: f"{100.0 * value:.0f}%" if value in (0.0, 1.0) else
                 f"{min(100.0 * value, 99.9):.1f}%")
"""A share in percent; 100 only if it is all."""


def tell(line: str) -> None:
    """Print what is being done, apart from what is found."""
    print(line, file=sys.stderr, flush=True)


class Column(NamedTuple):
    """A heading, the key of a row, and how its value is written."""

    head: str
    key: str
    shown: Callable[[Any], str] = digits


TIMES = (Column("median", "median_us"), Column("p95", "p95_us"), Column("p99.9", "p99.9_us"))


@final
@dataclass(frozen=True)
class Table:
    """Rows under a title, with a column for the name that `first` is the key of."""

    title: str
    rows: Sequence[Row]
    columns: Sequence[Column]
    first: str = "entrant"

    def cells(self) -> list[tuple[str, list[str]]]:
        """Return the name and the cells of each row."""
        return [(str(row[self.first]), [one.shown(row.get(one.key)) for one in self.columns])
                for row in self.rows]

    def rich(self) -> Rich:
        """Return the table for a terminal, without its title."""
        made = Rich(box=None, padding=(0, 1, 0, 0), pad_edge=False)
        made.add_column("", no_wrap=True)
        for column in self.columns:
            words = column.shown is text
            made.add_column(column.head, justify="left" if words else "right", no_wrap=not words,
                            overflow="fold" if words else "ellipsis")
        for name, cells in self.cells():
            made.add_row(name, *cells)
        return made


def write_rows(rows: Sequence[Row], path: Path) -> None:
    """Write rows as CSV; rows may have different columns."""
    make_folder(path.parent)
    with (named(path), written(path) as partial,
          partial.open("w", newline="", encoding="utf-8") as file):
        writer = csv.DictWriter(file, list(dict.fromkeys(key for row in rows for key in row)))
        writer.writeheader()
        writer.writerows(rows)


def wide(rows: Sequence[Row], down: str, across: str, values: Mapping[str, str],
         shown: Callable[[Any], str] = digits) -> tuple[list[Row], list[Column]]:
    """Return rows by the key `down`, with columns for each value of the key `across`.

    values : keys of what stands in them, by the second line of the heading, "" for none.
    """
    made: dict[Any, Row] = {}
    for row in rows:
        own = made.setdefault(row[down], {down: row[down]})
        own |= {f"{row[across]} {key}": row.get(key) for key in values.values()}
    return list(made.values()), [
        Column(name * (i == 0) + f"\n{head}" * bool(head), f"{name} {key}", shown)
        for name in dict.fromkeys(str(row[across]) for row in rows)
        for i, (head, key) in enumerate(values.items())]


@final
@dataclass(frozen=True)
class Section:
    """Tables with figures and words: `text` after the tables, each sentence of `lead` before."""

    title: str
    tables: Sequence[Table] = ()
    text: str = ""
    figures: Mapping[str, Figure] = field(default_factory=dict)
    lead: Sequence[str] = ()


@final
@dataclass(frozen=True)
class Report:
    """The sections of a benchmark, all rows by the name of their file, and who is missing why."""

    title: str
    sections: Sequence[Section]
    rows: Mapping[str, Sequence[Row]] = field(default_factory=dict)
    missing: Mapping[str, str] = field(default_factory=dict)
    failed: bool = False

    def say(self) -> None:
        """Print the tables and texts."""
        console = Console(highlight=False, markup=False)
        console.print(self.title, "", sep="\n")
        for section in self.sections:
            for table in section.tables:
                console.print(*([table.title] if table.title else []), table.rich(), "", sep="\n")
            for words in (*section.lead, section.text):
                if words:
                    console.print(words, "", sep="\n")
        if self.missing:
            console.print(Table("", [{"entrant": label, "why": why} for label, why in
                                     self.missing.items()], (Column("absent", "why", text),)
                                ).rich())

    def write(self, out: Path) -> None:
        """Write rows as CSV, figures as files, the machine, and the page into a folder."""
        make_folder(out)
        write_json(out / "machine.json", machine())
        write_json(out / "missing.json", dict(self.missing))
        for name, rows in self.rows.items():
            if rows:
                write_rows(rows, out / f"{name}.csv")
        for section in self.sections:
            for name, figure in section.figures.items():
                drawing.write(figure, str(out / slug(name)))
        write_text(out / "index.html", self._page())

    def _page(self) -> str:
        """Return the HTML page, which needs no other file."""
        shown = [(section, [(name, drawing.svg(figure, name), figure.get_figwidth())
                            for name, figure in section.figures.items()])
                 for section in self.sections]
        template = (Path(__file__).parent / "page.html").read_text(encoding="utf-8")
        return str(filled(template, style=resource("results/style.css"), title=self.title,
                          sections=shown, missing=dict(self.missing), machine=machine(),
                          command=shlex.join(["hierarchy", *sys.argv[1:]])))
