"""What a benchmark found: printed, written as CSV and figures, and as one HTML page."""

import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import final

from matplotlib.figure import Figure
from rich.console import Console

from benchmark.tables import Column, Row, Table, text, write_rows
from benchmark.timing import machine
from scenarios.draw.figures import drawing
from scenarios.files import make_folder, slug, write_json, write_text
from scenarios.templates import filled, resource


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
        shown = [(section, [(name, drawing.svg(figure, name))
                            for name, figure in section.figures.items()])
                 for section in self.sections]
        template = (Path(__file__).parent / "page.html").read_text(encoding="utf-8")
        return str(filled(template, style=resource("results/style.css"), title=self.title,
                          sections=shown, missing=dict(self.missing), machine=machine(),
                          command=shlex.join(["hierarchy", *sys.argv[1:]])))
