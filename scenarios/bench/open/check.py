"""A check of an entrant in a minute: a few problems of each kind."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import final

from scenarios.bench.open.exported import export
from scenarios.bench.open.families import family
from scenarios.bench.open.judge import (
    CRASHED,
    HUNG,
    RAISED,
    REFUSED,
    SOLVED,
    WRONG,
    Judged,
    judge,
)
from scenarios.bench.open.process import run_entrant
from scenarios.bench.open.run import rows_of
from scenarios.bench.open.summary import Times
from scenarios.bench.open.table import Row
from scenarios.bench.peers.environments import MissingError
from solvers.problems.files import read

FAMILIES = ("EQ7", "EQ7sing", "INEQ7", "tied_box", "contacts", "mixed_units", "one_unknown")
COUNT = 4   # problems of each
LIMIT = 2.0  # [s] for each


@final
@dataclass(frozen=True)
class Check:
    """What became of an entrant on the problems of the check, by family; or why it cannot run."""

    label: str
    version: str
    rows: dict[str, list[Judged]]
    missing: str = ""

    @property
    def well(self) -> bool:
        """Whether it runs, answers something, never ends early, and gives the same bits twice."""
        every = [row for own in self.rows.values() for row in own]
        answered = [row for row in every if row.x is not None]
        ended = any(row.verdict in (CRASHED, HUNG, RAISED) for row in every)
        return bool(answered) and not ended and all(row.same for row in answered)

    def __str__(self) -> str:
        if self.missing:
            return f"{self.label}: cannot run: {self.missing}"
        lines = [f"{self.label}: {self.version}"]
        for name, own in self.rows.items():
            lines.append(f"  {name:12} {_line(own)}")
        lines.append("  the rules are kept" if self.well else "  the rules are broken: see "
                     "docs/extending/entrant.md")
        return "\n".join(lines)


def check(row: Row) -> Check:
    """Run an entrant on a few public problems of each kind, and judge it."""
    with tempfile.TemporaryDirectory() as temporary:
        files = [export(family(name), 0, COUNT, True, Path(temporary)) for name in FAMILIES]
        collections = [read(file) for file in files]
        try:
            said = list(run_entrant(row, files, [len(one.problems) for one in collections],
                                    LIMIT))
        except MissingError as reason:
            return Check(row.label, "", {}, str(reason))
    found = {one.head.family: judge(rows_of(row, one, about, answers), {one.digest: one})
             for one, (about, answers) in zip(collections, said, strict=True)}
    return Check(row.label, said[0][0]["version"], found)


def _line(rows: list[Judged]) -> str:
    counts = {verdict: sum(row.verdict == verdict for row in rows)
              for verdict in dict.fromkeys(row.verdict for row in rows)}
    said = ", ".join(f"{verdict}: {count}" for verdict, count in counts.items())
    solved = [time for row in rows if row.verdict in (SOLVED, WRONG) for time in row.cold]
    if REFUSED in counts or not solved:
        return said
    worst = max(row.relative for row in rows if row.verdict in (SOLVED, WRONG))
    return f"{said}; miss {worst:.0e}; median {Times.of(solved).median:.1f} us"
