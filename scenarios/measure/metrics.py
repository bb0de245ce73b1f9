"""What is measured on a recording, in the order in which tables show it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np

from hierarchy import plugins
from scenarios.measure import safety, tracking  # noqa: F401, register metrics
from scenarios.measure.metric import Criteria, finite, register
from scenarios.measure.metric import Metric as Metric
from scenarios.recording.recording import Recording
from solvers import Status

_DONE = {"brake": "Ticks braked", "hold": "Ticks with the last command held",
         "use": "Ticks with trouble, answer sent", "stop": "Ticks that stopped the run",
         "clamp": "Ticks clamped to the limits"}
_PARTS = {"time_tick": "Whole tick", "time_kinematics": "Kinematics", "time_rows": "Rows",
          "time_resolve": "Resolve"}
_PERCENTILES = {"median": (50.0, "median"), "p95": (95.0, "95 %"), "p999": (99.9, "99.9 %")}

_GROUPS = ("Tracking", "Safety", "Contacts", "Torques", "Levels", "Singularities", "Switching",
           "Computing")  # as tables show them
_metric = partial(Metric, group="Computing")


@register("switching")
def _switching(recording: Recording, by: Criteria) -> Iterator[Metric]:
    metric = partial(Metric, unit="", group="Switching")
    yield metric("stack_changes", "Changes of the stack", float(recording.switches().size))
    known = recording.signals.get("active_set")
    if known is not None or recording.facts.asks != "equalities":
        changes = None if known is None else float(np.count_nonzero(np.diff(known[known >= 0])))
        yield metric("active_set_changes", "Changes of the active set", changes,
                     lower_is_better=None,
                     note="of the inequality rows that act, where the resolver reports them")
    if "active_control_point" in recording:
        moved = np.count_nonzero(np.diff(recording["active_control_point"].astype(int)))
        yield metric("active_point_changes", "Changes of the active point", float(moved))


@register("troubles")
def _troubles(recording: Recording, by: Criteria) -> Iterator[Metric]:
    for action, label in _DONE.items():
        if ticks := {event.tick for event in recording.events if event.action == action}:
            yield _metric(f"ticks_{action}", label, float(len(ticks)), "")


@register("time")
def _time(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "status" in recording:
        failed = np.count_nonzero(recording["status"] != int(Status.SOLVED))
        yield _metric("ticks_not_solved", "Ticks not solved", float(failed), "")
    if "time_tick" in recording:
        late = np.count_nonzero(recording["time_tick"] > recording.scenario.control.period)
        yield _metric("ticks_late", "Ticks longer than the period", float(late), "")
    for signal, part in _PARTS.items():
        shared = signal in ("time_kinematics", "time_rows")  # the same code under any resolver
        for key, (percent, label) in _PERCENTILES.items() if signal in recording else ():
            yield _metric(f"{signal}_{key}", f"{part}, {label}",
                          finite(np.percentile(recording[signal], percent)), "s",
                          lower_is_better=None if shared else True,
                          detail=shared and key != "median")


def measure(recording: Recording, settle: float = 2.0,
            cone_tolerance_deg: float = 0.01) -> dict[str, Metric]:
    """Return the metrics of a run by name, in the order in which tables show them.

    Parameters
    ----------
    settle : [s] after which the start, which may lie off the path, no longer counts.
    cone_tolerance_deg : [deg] beyond the cone that still counts as being on it.

    Distances, joint speeds and joint limits are judged by the true state where it is known apart
    from the measured one. A plugin adds metrics with `register("metrics", NAME)` on a function of
    a recording and Criteria that yields them.
    """
    if recording.ticks == 0:
        return {}
    by = Criteria(settle, cone_tolerance_deg)
    found = [metric for measured in plugins.known("metrics").values()
             for metric in measured(recording, by)]
    groups = {group: place for place, group in enumerate(_GROUPS)}
    found.sort(key=lambda metric: groups.get(metric.group, len(groups)))
    return {metric.name: metric for metric in found}


def as_plain_data(recording: Recording) -> dict[str, Any]:
    """Return ticks, fault, events, and each metric as `plain` has it, for a JSON file."""
    events = [{"kind": kind, "action": action, "ticks": len(ticks), "first_tick": ticks[0],
               "first_time": float(recording["t"][ticks[0]])}
              for (kind, action), ticks in recording.troubles().items()]
    return {"ticks": recording.ticks, "fault": recording.fault, "events": events,
            "metrics": {metric.name: plain(metric) for metric in measure(recording).values()}}


def plain(metric: Metric) -> dict[str, Any]:
    """Return a metric as plain data for a JSON file."""
    note = {"note": metric.note} if metric.note else {}
    return {"value": metric.value, "unit": metric.unit, "label": metric.label,
            "lower_is_better": metric.lower_is_better, **note}
