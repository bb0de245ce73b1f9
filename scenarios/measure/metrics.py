"""What is measured on a recording, in the order in which tables show it."""

import warnings
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

import numpy as np

from hierarchy import plugins
from hierarchy.errors import expect_each, refuse
from hierarchy.problem import Array
from scenarios.measure import safety
from scenarios.measure.metric import NOTHING, Criteria, finite, known, largest, register
from scenarios.measure.metric import Metric as Metric
from scenarios.recording import listed
from scenarios.recording.blame import blamed
from scenarios.recording.recording import Recording
from solvers import Status

_STILL = 0.01    # largest joint speed [rad/s] of a robot that counts as standing still
_FAR = 0.01      # error [m] at which it should not
_AFTER = 0.5     # [s] after the return within reach that do not count as error

_DONE = {"brake": "Ticks braked", "hold": "Ticks with the last command held",
         "use": "Ticks with trouble, answer sent", "stop": "Ticks that stopped the run",
         "clamp": "Ticks clamped to the limits"}
PARTS = {"time_tick": "Whole tick", "time_kinematics": "Kinematics", "time_rows": "Rows",
         "time_resolve": "Resolve"}
_PERCENTILES = {"median": (50.0, "median"), "p95": (95.0, "95 %"), "p999": (99.9, "99.9 %")}

_GROUPS = ("Tracking", "Safety", "Contacts", "Torques", "Levels", "Singularities", "Switching",
           "Computing")  # as tables show them

Spans = Sequence[tuple[float, float]]
_tracks = partial(Metric, group="Tracking")
_timing = partial(Metric, group="Computing")


@register("tracking")
def _tracking(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "position_error" not in recording:
        return
    error = recording.off_path()
    metrics = partial(_rms_and_max, group="Tracking")
    after = error[recording["t"] - recording["t"][0] >= by.settle]
    settled = f"Error after {by.settle:g} s"
    yield from metrics("position_error", "Position error", error, "m")
    yield from metrics("position_error", settled, after, "m", suffix="_settled")
    yield _tracks("position_error_median_settled", f"{settled}, median",
                  finite(np.median(after)) if after.size else None, "m")


@register("pointing")
def _pointing(recording: Recording, by: Criteria) -> Iterator[Metric]:
    pointing = recording.scenario.pointing
    if "pointing_error" not in recording or pointing is None:
        return
    half_angle = pointing.alpha_d
    beyond = pointing.angle(recording.true("pointing_error")) - half_angle
    yield _tracks("cone_violation_max", "Beyond the cone, max",
                  finite(max(float(beyond.max()), 0.0)), "deg", note=f"a cone of {half_angle:g}°")
    yield _tracks("cone_violation_share", "Time outside the cone",
                  float(np.mean(beyond > by.cone_tolerance_deg)), "share",
                  note=f"outside by more than {by.cone_tolerance_deg:g}°")


@register("listed")
def _listed(recording: Recording, by: Criteria) -> Iterator[Metric]:
    """Errors of the tasks of `[[tasks]]`, each under its name."""
    after = recording["t"] - recording["t"][0] >= by.settle
    for section, unit, exact in listed.errors(recording):
        error = np.where(exact < NOTHING, 0.0, exact)
        turned = unit == "deg" and section.kind in ("pose", "frame", "relative")
        title = section.title[0].upper() + section.title[1:] + (", turned" if turned else "")
        key = f"task_{section.title}{' turned' if turned else ''}".replace(" ", "_")
        lower = None if section.kind == "posture" else True  # it gets what is left
        yield _tracks(f"{key}_rms", f"{title}: error, rms",
                      finite(np.sqrt(np.mean(error**2))), unit, lower)
        yield _tracks(f"{key}_max_settled", f"{title}: after {by.settle:g} s, max",
                      largest(error[after]), unit, lower)
        yield _tracks(f"{key}_end", f"{title}: at the end", finite(error[-1]), unit, lower,
                      detail=True)


@register("strictness")
def _strictness(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "moved_by_lower" in recording:
        yield _tracks("moved_by_lower_max", "Moved by lower tasks in a tick, max",
                      largest(known(recording["moved_by_lower"])), "m", note="strict: not at all")


@register("returning")
def _returning(recording: Recording, by: Criteria) -> Iterator[Metric]:
    """Metrics of runs whose path leaves the workspace: freezes, jerk, limits, the way back."""
    found = _left_path(recording)
    if found is None:
        return
    (spans, error), t, v, group = found, recording["t"], recording.true("v"), "Singularities"
    within, back = (np.all([(t < begin) | (t > end + after) for begin, end in spans], axis=0)
                    for after in (0.0, _AFTER))
    still = np.abs(v).max(axis=1, initial=0.0) < _STILL
    yield Metric("ticks_frozen", "Ticks frozen", float((still & (error > _FAR) & within).sum()),
                 "", group=group, note="still and off a path within reach")
    returned = error[back & (t > min(end for _, end in spans) + _AFTER)]
    yield from _rms_and_max("error_returned", "Error after return", returned, "m", group=group,
                            note=f"from {_AFTER:g} s after the path is within reach")
    jerk = np.diff(recording["a"], axis=0) / np.diff(t)[:, None]
    yield from _rms_and_max("jerk", "Joint jerk", jerk, safety.units_of(recording, "/s^3"),
                            group=group)
    excess = np.maximum(np.abs(v) - recording["velocity_limit"], 0.0)
    yield Metric("speed_limit_excess", "Beyond a speed limit, max", largest(excess),
                 safety.units_of(recording, "/s"), group=group)


def _left_path(recording: Recording) -> tuple[Spans, Array] | None:
    """Return when the first path that leaves the workspace does so, and the error (T,) from it."""
    position = recording.scenario.position
    path = position.path if position else None
    if path is not None and path.out_of_reach and "position_error" in recording:
        return path.out_of_reach, recording.off_path()
    for section, unit, error in listed.errors(recording):
        path = getattr(section, "path", None)
        if unit == "m" and path is not None and path.out_of_reach:
            return path.out_of_reach, error
    return None


def _rms_and_max(key: str, label: str, values: Array, unit: str, *, group: str, suffix: str = "",
                 note: str = "") -> Iterator[Metric]:
    """Yield the root of the mean square and the largest magnitude of values."""
    rms = finite(np.sqrt(np.mean(values**2))) if values.size else None
    yield Metric(f"{key}_rms{suffix}", f"{label}, rms", rms, unit, group=group)
    yield Metric(f"{key}_max{suffix}", f"{label}, max", largest(values), unit, group=group,
                 note=note)


@register("switching")
def _switching(recording: Recording, by: Criteria) -> Iterator[Metric]:
    metric = partial(Metric, unit="", group="Switching")
    yield metric("stack_changes", "Changes of the stack", float(recording.switches().size))
    acting = recording.signals.get("active_set")
    if acting is not None or recording.facts.asks != "equalities":
        changes = None if acting is None else float(np.count_nonzero(np.diff(acting[acting >= 0])))
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
            yield _timing(f"ticks_{action}", label, float(len(ticks)), "")


@register("time")
def _time(recording: Recording, by: Criteria) -> Iterator[Metric]:
    failed = np.count_nonzero(recording["status"] != int(Status.SOLVED))
    yield _timing("ticks_not_solved", "Ticks not solved", float(failed), "")
    beside = recording.beside_computing
    physics = " with physics" * bool(beside)
    late = recording["time_tick"] > recording.scenario.control.period
    yield _timing("late_share", f"Ticks{physics} longer than the period", finite(np.mean(late)),
                  "share", lower_is_better=None, note=beside)  # the operating system interrupts
    for signal, part in PARTS.items():
        shared = signal in ("time_kinematics", "time_rows")  # the same code under any resolver
        for key, (percent, label) in _PERCENTILES.items():
            yield _timing(f"{signal}_{key}",
                          f"{part}{physics if signal == 'time_tick' else ''}, {label}",
                          finite(np.percentile(recording[signal], percent)), "s",
                          lower_is_better=None if shared or key == "p999" else True,
                          note=beside if signal == "time_tick" else "",
                          detail=shared and key != "median")


def measure(recording: Recording, settle: float = 2.0,
            cone_tolerance_deg: float = 0.01) -> dict[str, Metric]:
    """Return the metrics of a run by name, in the order in which tables show them.

    Parameters
    ----------
    settle : [s] after which the start, which may lie off the path, no longer counts.
    cone_tolerance_deg : [deg] beyond the cone that still counts as being on it.

    Position, distances, joint speeds, limits, cone and listed tasks are judged by the true state
    where it is known apart from the measured one. A plugin adds metrics with
    `register("metrics", NAME)` on a function of a recording and Criteria that yields them; if one
    fails, a warning says so.
    """
    if recording.ticks == 0:
        return {}
    by, found = Criteria(settle, cone_tolerance_deg), dict[str, Metric]()
    for name, measures in plugins.known("metrics").items():
        try:
            metrics = list(measures(recording, by))
            expect_each("what it yields", metrics, Metric, "yield these")
            made = dict(found)
            for metric in metrics:
                refuse(metric.name in made, f"others yield {metric.name!r} too")
                made[metric.name] = metric
            found = made
        except (Exception, SystemExit) as error:  # a user's code, which must not cost the run
            warnings.warn(f"metrics {name!r} are left out: {blamed(error)}", stacklevel=1)
    groups = {group: place for place, group in enumerate(_GROUPS)}
    return dict(sorted(found.items(), key=lambda item: groups.get(item[1].group, len(groups))))


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
