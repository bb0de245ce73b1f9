"""What is measured on a recording, in the order in which tables show it."""

from __future__ import annotations

from typing import Any

from hierarchy import plugins
from scenarios.measure import computing, forces, safety, tracking  # noqa: F401, register metrics
from scenarios.measure.metric import Criteria
from scenarios.measure.metric import Metric as Metric
from scenarios.recording.recording import Recording

_GROUPS = ("Tracking", "Safety", "Contacts", "Torques", "Levels", "Singularities", "Switching",
           "Computing")  # as tables show them


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
