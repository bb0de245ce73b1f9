"""How often the stack changed, what the policy did, and how long a tick took."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from scenarios.measure.metric import Criteria, Metric, finite, register
from scenarios.recording.recording import Recording
from solvers import Status

_DONE = {"brake": "Ticks braked", "hold": "Ticks with the last command held",
         "use": "Ticks with trouble, answer sent", "stop": "Ticks that stopped the run",
         "clamp": "Ticks clamped to the limits"}
_PARTS = {"time_tick": "Whole tick", "time_kinematics": "Kinematics", "time_rows": "Rows",
          "time_resolve": "Resolve"}
_PERCENTILES = {"median": (50.0, "median"), "p95": (95.0, "95 %"), "p999": (99.9, "99.9 %")}

_metric = partial(Metric, group="Computing")


@register("switching")
def _switching(recording: Recording, by: Criteria) -> Iterator[Metric]:
    metric = partial(Metric, unit="", group="Switching")
    yield metric("stack_changes", "Changes of the stack", float(recording.switches().size))
    if "active_set" in recording or recording.facts.asks != "equalities":
        known = recording.get("active_set", np.zeros(0))
        changes = (float(np.count_nonzero(np.diff(known[known >= 0])))
                   if "active_set" in recording else None)
        yield metric("active_set_changes", "Changes of the active set", changes,
                     lower_is_better=None,
                     note="of the inequality rows that act, where the resolver reports them")
    if "active_control_point" in recording:
        changes = np.count_nonzero(np.diff(recording["active_control_point"].astype(int)))
        yield metric("active_point_changes", "Changes of the active point", float(changes))


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
