"""The same scenarios under several resolvers, laid side by side."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass
from typing import Any

from hierarchy.notebook import html_table
from scenarios.measure.motions import partings
from scenarios.measure.runs import Run, table
from scenarios.measure.verdict import lines, verdicts


@dataclass(frozen=True, repr=False)
class Comparison:
    """Runs in the order asked for, scenario by scenario.

    `refused` says of each resolver that cannot resolve a scenario why it was not run; `folder` is
    where the runs' folders lie, as it was named, or None if they were not kept.
    """

    runs: tuple[Run, ...]
    command: str
    versions: dict[str, str]
    refused: tuple[str, ...] = ()
    folder: str | None = None

    def __repr__(self) -> str:
        labels = dict.fromkeys(run.label for run in self.runs)
        return (f"Comparison({', '.join(self._names)} under {', '.join(labels)}; "
                f"{len(self.runs)} runs, {len(self.faults)} faults)")

    def _repr_html_(self) -> str:
        """Return a table for each group: a row per metric, the best in bold."""
        found = ""
        for name, runs in self.groups().items():
            rows = table(runs, details=False)
            best = {(i, j + 1) for i, row in enumerate(rows)
                    for j, cell in enumerate(row.cells) if cell.kind == "best"}
            cells = [(row.heading, *(cell.text for cell in row.cells)) for row in rows]
            faults = [("fault", *(run.fault or "" for run in runs))] if any(
                run.fault for run in runs) else []
            found += html_table(name, ("", *(run.label for run in runs)), [*cells, *faults], best)
        return found

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(run.scenario.name for run in self.runs))

    @property
    def faults(self) -> list[Run]:
        """The runs that did not reach their end."""
        return [run for run in self.runs if run.fault]

    def asked(self, *options: str) -> str:
        """Return the command that compares the same, with further options."""
        specs = ",".join(dict.fromkeys(run.spec for run in self.runs))
        return shlex.join(["hierarchy", "compare", *self._names, "--resolvers", specs, *options])

    def groups(self) -> dict[str, list[Run]]:
        """Return the runs that stand side by side, with the name of each group.

        Those are the runs of one scenario; or, with one resolver, the runs of all scenarios.
        """
        if len(self.runs) > 1 and len({run.spec for run in self.runs}) == 1:
            return {self.runs[0].spec: list(self.runs)}
        return {name: [run for run in self.runs if run.scenario.name == name]
                for name in self._names}

    def as_plain_data(self) -> dict[str, Any]:
        """Return what `comparison.json` holds."""
        return {"command": self.command, "versions": self.versions,
                "verdicts": {name: list(lines(verdicts(runs)))
                             for name, runs in self.groups().items()},
                "runs": [run.as_plain_data() | verdicts([run])[0].as_plain_data()
                         for run in self.runs], "refused": list(self.refused),
                "partings": {name: [
                    {"label": one.label, "from": one.other, "bound_rad": one.bound,
                     "tick": one.tick, "why": one.why,
                     "largest_rad": one.largest if math.isfinite(one.largest) else None}
                    for one in partings(runs)] for name, runs in self.groups().items()}}
