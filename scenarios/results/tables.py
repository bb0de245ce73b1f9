"""The tables of the page: numbers with the best marked, events, settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from markupsafe import Markup

from scenarios.draw.figures.palette import Look
from scenarios.measure.partings import BOUND, partings
from scenarios.measure.runs import table
from scenarios.results.columns import flags
from scenarios.templates import render

if TYPE_CHECKING:
    from scenarios.measure.runs import Run

# The most important metrics; the others are folded away.
_FIRST = ("position_error_median_settled", "position_error_max_settled", "cone_violation_max",
          "moved_by_lower_max", "body_distance_min", "body_below_share", "ee_distance_min",
          "ee_below_share", "contact_ticks", "slip_max", "friction_margin_min",
          "support_margin_min", "torque_limit_share", "torque_step_max", "torque_step_ticks",
          "joint_limit_excess", "speed_max", "velocity_step_max", "velocity_step_ticks",
          "command_step_max", "acceleration_max", "acceleration_step_max",
          "acceleration_step_ticks", "stack_changes", "active_set_changes", "ticks_not_solved",
          "ticks_brake", "ticks_stop", "ticks_late", "time_resolve_median", "time_resolve_p999",
          "time_tick_median")


def numbers(runs: Sequence[Run], looks: Mapping[str, Look]) -> Markup:
    """Return the metrics with the best of each row marked; minor ones are folded away."""
    rows = table(runs, details=False)
    first, rest = ([row for row in rows if _is_first(row.name) == is_first]
                   for is_first in (True, False))
    marked = flags({run.label: run.scenario for run in runs})
    heads = {run.label: [(kind, text) for kind, text in (
        ("alert", _stopped(run)), ("quiet", marked[run.label])) if text] for run in runs}
    return render("results/measured.html", heads=heads, looks=looks, first=first, rest=rest,
                  said=_marks(runs)) if rows else Markup()


def _is_first(name: str) -> bool:
    return name in _FIRST or (name.startswith("task_") and name.endswith("_rms"))


def _marks(runs: Sequence[Run]) -> str:
    """Return what the marks mean and what to know about the numbers."""
    if all(run.fault for run in runs):
        return "No run was completed, so none is marked as best."
    detour = any(run.recording and "repulsion_active" in run.recording
                 and run.recording["repulsion_active"].any() for run in runs)
    one = len({run.scenario.name for run in runs}) == 1
    marks = ("The best value of each row is coloured and has a dot; values within 1 % count as "
             "equal, and rows in which all are equal are unmarked." if one else
             "The scenarios differ, so none is marked as best.")
    stopped = (" Runs that stopped early are grey and not compared."
               if any(run.fault for run in runs) else "")
    return marks + stopped + (
        " The position error includes the detour of the end effector around obstacles on its path."
        if detour else "")


def _stopped(run: Run) -> str:
    if run.fault is None:
        return ""
    if run.recording is None or not run.recording.ticks:
        return "did not start"
    return f"stopped at {run.recording['t'][-1]:.2f} s"


def events(runs: Sequence[Run]) -> list[tuple[str, tuple[str, str, str, str]]]:
    """Return what happened in every run: problems, contacts, large changes, faults.

    That is the problem, the action taken or the reason, the number of ticks and the first time.
    Only the first row of a run has its label.
    """
    return [(run.label if i == 0 else "", row)
            for run in runs for i, row in enumerate(_happened(run))]


def _happened(run: Run) -> list[tuple[str, str, str, str]]:
    recording = run.recording
    found = [(what, why, str(ticks), f"{t:.3f} s") for what, why, ticks, t in run.happened]
    if run.fault:
        ended = f"{recording['t'][-1]:.3f} s" if recording and recording.ticks else "the start"
        found.append((f"fault: {run.fault}", "run stopped", "–", ended))
    return found


def parted(runs: Sequence[Run]) -> Markup:
    """Return where the runs of strict resolvers diverge, and why."""
    found = [str(one) for one in partings(runs)]
    return render("results/partings.html", partings=found, bound=BOUND) if found else Markup()


def settings(runs: Sequence[Run]) -> Markup:
    """Return the resolvers' settings and the scenario files as used."""
    first = {run.scenario.name: run for run in reversed(runs)}
    rows = [(run, ", ".join(f"{name} = {value!r}" for name, value in run.settings.items())
             or "none") for run in runs]
    return render("results/settings.html", rows=rows, scenarios=list(reversed(first.values())))
