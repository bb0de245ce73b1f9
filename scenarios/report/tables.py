"""The tables of the report: numbers with the best marked, events, settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from scenarios.draw.figures.palette import Look
from scenarios.measure.partings import BOUND, partings
from scenarios.report.parts import chip, folded, plain_table, section

if TYPE_CHECKING:
    from scenarios.measure.runs import Row, Run

# What most readers ask; the rest is folded away.
_FIRST = ("position_error_median_settled", "position_error_max_settled", "cone_violation_max",
          "moved_by_lower_max", "body_distance_min", "ee_distance_min", "contact_ticks",
          "joint_limit_excess", "speed_max", "velocity_step_max", "acceleration_max",
          "stack_changes", "ticks_not_solved", "ticks_brake", "ticks_stop", "ticks_late",
          "time_resolve_median", "time_resolve_p999", "time_tick_median")


def numbers(runs: Sequence[Run], looks: Mapping[str, Look]) -> str:
    """Return what was measured, best of each row marked; the less asked for is folded away."""
    from scenarios.measure.runs import table

    rows = table(runs, details=False)
    first = [row for row in rows if _is_first(row.name)]
    rest = [row for row in rows if not _is_first(row.name)]
    more = folded(f"{len(rest)} more rows", _table(rest, runs, looks)) if rest else ""
    return section("In numbers", _table(first, runs, looks) + more, _marks(runs)) if rows else ""


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


def _table(rows: Sequence[Row], runs: Sequence[Run], looks: Mapping[str, Look]) -> str:
    heads = "".join(f"<th>{chip(looks[run.label])}{escape(run.label)}{_stopped(run)}</th>"
                    for run in runs)
    out = [run.fault is not None for run in runs]
    body = []
    for group, some in groupby(rows, key=lambda row: row.group):
        body.append(f'<tr class="group"><th colspan="{len(runs) + 1}">{escape(group)}</th></tr>')
        body += [_line(row, out) for row in some]
    return (f'<div class="scroll"><table class="numbers"><thead><tr><th></th>{heads}</tr></thead>'
            f"\n<tbody>{''.join(body)}</tbody></table></div>")


def _stopped(run: Run) -> str:
    if run.fault is None:
        return ""
    if run.recording is None or not run.recording.ticks:
        return '<br><small class="alert">did not begin</small>'
    return f'<br><small class="alert">stopped at {run.recording["t"][-1]:.2f} s</small>'


def _line(row: Row, out: Sequence[bool]) -> str:
    unit = f" <small class='quiet'>[{escape(row.unit)}]</small>" if row.unit else ""
    cells = []
    for i, (cell, note) in enumerate(zip(row.cells, row.notes, strict=True)):
        kind = "best" if i in row.best else "out" if out[i] else ""
        title = f' title="{escape(note)}"' if note else ""
        cells.append(f'<td class="{kind}"{title}>{escape(cell)}</td>')
    return f"<tr><th>{escape(row.label)}{unit}</th>{''.join(cells)}</tr>"


def events(runs: Sequence[Run], looks: Mapping[str, Look]) -> str:
    """Return every kind of trouble of every run, contacts and faults, as a table or a sentence."""
    rows = [(f"{chip(looks[run.label])}{escape(run.label)}" if i == 0 else "",
             *map(escape, happened))
            for run in runs for i, happened in enumerate(_happened(run))]
    if not rows:
        return ('<p class="quiet">No run had a tick without an answer, with bad measurements, with '
                "a command that was changed, or with contact.</p>")
    return plain_table(rows, ("run", "what", "what was done", "ticks", "first at"))


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


def parted(runs: Sequence[Run]) -> str:
    """Return where strict resolvers' runs part from each other, and why."""
    said = "".join(f"<li>{escape(str(one))}.</li>" for one in partings(runs))
    return section("Where they part", f"<ul>{said}</ul>",
                   "Resolvers that are strict at every rank solve the same problem at every tick, "
                   f"so their joints should follow the same path; the bound is {BOUND:.0e} rad, or "
                   "the accuracy that a resolver declares where that is more.") if said else ""


def settings(runs: Sequence[Run]) -> str:
    """Return the resolvers' settings as used, and each scenario as run."""
    rows = [(escape(run.label), f"<code>{escape(_in_text(run.settings))}</code>",
             f'<a href="{escape(run.folder)}/">{escape(run.folder)}/</a>') for run in runs]
    asked = {run.scenario.name: run for run in reversed(runs)}
    files = "".join(folded(f"{name}.toml, as run by {run.spec}",
                           f"<pre><code>{escape(run.scenario.to_toml())}</code></pre>")
                    for name, run in reversed(asked.items()))
    return section("Settings", plain_table(rows) + files, "As they were used, damping included; "
                   "every run's folder has the whole scenario.")


def _in_text(named: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} = {value!r}" for name, value in named.items()) or "none"
