"""The tables of the report: numbers with the best marked, events, settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from scenarios.draw.figures.palette import Look
from scenarios.measure.partings import BOUND, partings
from scenarios.report.templates import render

if TYPE_CHECKING:
    from scenarios.measure.runs import Row, Run

Cell = tuple[str, str, str]  # its kind, "" for none; a note; the text

# What most readers ask; the rest is folded away.
_FIRST = ("position_error_median_settled", "position_error_max_settled", "cone_violation_max",
          "moved_by_lower_max", "body_distance_min", "ee_distance_min", "contact_ticks",
          "joint_limit_excess", "speed_max", "velocity_step_max", "acceleration_max",
          "stack_changes", "ticks_not_solved", "ticks_brake", "ticks_stop", "ticks_late",
          "time_resolve_median", "time_resolve_p999", "time_tick_median")


def numbers(runs: Sequence[Run], looks: Mapping[str, Look]) -> Markup:
    """Return what was measured, best of each row marked; the less asked for is folded away."""
    from scenarios.measure.runs import table

    rows = table(runs, details=False)
    rest = [row for row in rows if not _is_first(row.name)]
    return render("report/numbers.html", heads=[(run.label, _stopped(run)) for run in runs],
                  looks=looks, first=_grouped([row for row in rows if _is_first(row.name)], runs),
                  rest=_grouped(rest, runs), count=len(rest),
                  said=_marks(runs)) if rows else Markup()


def _is_first(name: str) -> bool:
    return name in _FIRST or (name.startswith("task_") and name.endswith("_rms"))


def _marks(runs: Sequence[Run]) -> str:
    """Say what the marks mean, and what the numbers contain that is not obvious."""
    if all(run.fault for run in runs):
        return "No run reached its end, so none is marked as best."
    detour = any(run.recording and "repulsion_active" in run.recording
                 and run.recording["repulsion_active"].any() for run in runs)
    marks = ("Best of each row in colour, with a dot; within 1 % is as good, and a row where all "
             "are is unmarked." if len({run.scenario.name for run in runs}) == 1 else
             "Different scenarios ask for different things, so none is marked as best.")
    stopped = (" Runs that did not reach their end, in grey, take no part."
               if any(run.fault for run in runs) else "")
    return marks + stopped + (" The position error contains the detour by which the end effector "
                              "is pushed around an obstacle on its path." if detour else "")


def _grouped(rows: Sequence[Row], runs: Sequence[Run]
             ) -> list[tuple[str, list[tuple[Row, list[Cell]]]]]:
    """Return rows with their cells, by group."""
    out = [run.fault is not None for run in runs]
    return [(group, [(row, _cells(row, out)) for row in some])
            for group, some in groupby(rows, key=lambda row: row.group)]


def _cells(row: Row, out: Sequence[bool]) -> list[Cell]:
    return [("best" if i in row.best else "out" if out[i] else "", note, cell)
            for i, (cell, note) in enumerate(zip(row.cells, row.notes, strict=True))]


def _stopped(run: Run) -> str:
    if run.fault is None:
        return ""
    if run.recording is None or not run.recording.ticks:
        return "did not begin"
    return f"stopped at {run.recording['t'][-1]:.2f} s"


def events(runs: Sequence[Run]) -> list[tuple[str, tuple[str, str, str, str]]]:
    """Return every kind of trouble of every run, contacts and faults.

    A run's label stands beside the first of its own only.
    """
    return [(run.label if i == 0 else "", happened)
            for run in runs for i, happened in enumerate(_happened(run))]


def _happened(run: Run) -> list[tuple[str, str, str, str]]:
    """Return what, what was done, in how many ticks and when first."""
    recording = run.recording
    found = []
    if recording is not None:
        t = recording["t"]
        found = [(kind.replace("_", " "), action, str(len(ticks)), f"{t[ticks[0]]:.3f} s")
                 for (kind, action), ticks in recording.troubles().items()]
        touched = np.flatnonzero(recording.signals.get("contacts", ()))
        if touched.size:
            found.append(("contact", "–", str(touched.size), f"{t[touched[0]]:.3f} s"))
    if run.fault:
        ended = f"{recording['t'][-1]:.3f} s" if recording and recording.ticks else "the start"
        found.append((f"fault: {run.fault}", "run ended", "–", ended))
    return found


def parted(runs: Sequence[Run]) -> Markup:
    """Return where strict resolvers' runs part from each other, and why."""
    found = [str(one) for one in partings(runs)]
    return render("report/partings.html", partings=found, bound=BOUND) if found else Markup()


def settings(runs: Sequence[Run]) -> Markup:
    """Return the resolvers' settings as used, and each scenario as run."""
    first = {run.scenario.name: run for run in reversed(runs)}
    return render("report/settings.html", rows=[(run, _in_text(run.settings)) for run in runs],
                  scenarios=list(reversed(first.values())))


def _in_text(named: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {value!r}" for name, value in named.items()) or "none"
