"""What is measured on a recording; every number has a unit, a plain name and a direction."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy import plugins

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording

Array = NDArray[np.float64]
_ON_IT = 1e-4  # [m] below a distance that still counts as keeping it
_NOTHING = 1e-9  # errors of listed tasks below this are rounding and count as zero [m, deg, rad]

# Display units by SI unit: how many of them make one, what it is called, decimals.
_SHOWN = {"m": (1e3, "mm", 3), "s": (1e6, "µs", 2), "deg": (1.0, "°", 3), "share": (100.0, "%", 2),
          "rad": (1.0, "rad", 3), "rad/s": (1.0, "rad/s", 3), "rad/s^2": (1.0, "rad/s²", 2),
          "rad/s^3": (1.0, "rad/s³", 0),
          "N": (1.0, "N", 1), "N m": (1.0, "N m", 2), "N s": (1.0, "N s", 3),
          "N m s": (1.0, "N m s", 3),
          "rows": (1.0, "", 3), "": (1.0, "", 0)}  # "rows": in the units of a level's rows


def shown(value: float, unit: str) -> str:
    """Return a value in an SI unit as it stands in a sentence: three digits, display unit."""
    scale, name, _ = _SHOWN.get(unit, (1.0, unit, 3))
    number = f"{value * scale:.3g}" if abs(value * scale) < 999.5 else f"{value * scale:.0f}"
    return number + (name if name == "°" else f" {name}" if name else "")


@dataclass(frozen=True)
class Metric:
    """One number about one run.

    `value` is in the SI `unit` ("" for a count, "share" of 1, "deg"), and None when the run has
    no such thing. `lower_is_better` is None where neither direction is. A `detail` is left out of
    tables that must be short.
    """

    name: str
    label: str
    value: float | None
    unit: str
    lower_is_better: bool | None = True
    group: str = ""
    note: str = ""
    detail: bool = False

    @property
    def _display(self) -> tuple[float, str, int]:
        return _SHOWN.get(self.unit, (1.0, self.unit, 3))

    @property
    def shown_unit(self) -> str:
        """The unit in which tables show the value."""
        return self._display[1]

    @property
    def scale(self) -> float:
        """How many of `shown_unit` make one SI unit."""
        return self._display[0]

    def shown(self) -> str:
        """Return the value for a table: in `shown_unit`, without the unit."""
        if self.value is None:
            return "–"
        scale, _, decimals = self._display
        value = self.value * scale
        if value != 0.0 and (abs(value) < 0.5 * 10.0**-decimals or abs(value) >= 1e5):
            return f"{value:.1e}"
        return f"{value:.{decimals}f}"


class Criteria(NamedTuple):
    """What metrics are judged by, see `measure`."""

    settle: float
    cone_tolerance_deg: float


_register = partial(plugins.register, "metrics", shipped=True)


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
    return {metric.name: metric for found in plugins.known("metrics").values()
            for metric in found(recording, by)}


def as_plain_data(recording: Recording) -> dict[str, Any]:
    """Return what `metrics.json` holds: ticks, fault, events, and each metric as `plain` has it."""
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


@_register("tracking")
def _tracking(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "position_error" not in recording:
        return
    error = np.linalg.norm(recording["position_error"], axis=1)
    after = error[recording["t"] - recording["t"][0] >= by.settle]
    spans = (("", "Position error", error), ("_settled", f"Error after {by.settle:g} s", after))
    for suffix, when, e in spans:
        yield Metric(f"position_error_rms{suffix}", f"{when}, rms",
                     _finite(np.sqrt(np.mean(e**2))) if e.size else None, "m", group="Tracking")
        yield Metric(f"position_error_max{suffix}", f"{when}, max",
                     _largest(e), "m", group="Tracking")
    yield Metric("position_error_median_settled", f"Error after {by.settle:g} s, median",
                 _finite(np.median(after)) if after.size else None, "m", group="Tracking")
    if "true_ee_position" in recording:
        true = np.linalg.norm(recording["desired_position"] - recording["true_ee_position"], axis=1)
        yield Metric("true_position_error_rms", "True position error, rms",
                     _finite(np.sqrt(np.mean(true**2))), "m", group="Tracking")
        yield Metric("true_position_error_max", "True position error, max", _largest(true), "m",
                     group="Tracking")


@_register("pointing")
def _pointing(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "pointing_error" not in recording or recording.scenario.pointing is None:
        return
    half_angle = recording.scenario.pointing.alpha_d
    beyond = pointing_angle(recording) - half_angle
    yield Metric("cone_violation_max", "Beyond the cone, max",
                 _finite(max(float(beyond.max()), 0.0)), "deg", group="Tracking",
                 note=f"a cone of {half_angle:g}°")
    yield Metric("cone_violation_share", "Time outside the cone",
                 float(np.mean(beyond > by.cone_tolerance_deg)), "share", group="Tracking",
                 note=f"outside by more than {by.cone_tolerance_deg:g}°")


@_register("listed")
def _listed(recording: Recording, by: Criteria) -> Iterator[Metric]:
    """Errors of the tasks of `[[tasks]]`, each under its name."""
    if not recording.scenario.tasks:
        return
    from scenarios.recording.listed import errors

    after = recording["t"] - recording["t"][0] >= by.settle
    for section, unit, exact in errors(recording):
        error = np.where(exact < _NOTHING, 0.0, exact)
        turned = unit == "deg" and section.kind in ("pose", "frame", "relative")
        title = section.title[0].upper() + section.title[1:] + (", turned" if turned else "")
        key = f"task_{section.title}{' turned' if turned else ''}".replace(" ", "_")
        lower = None if section.kind == "posture" else True  # it gets what is left
        yield Metric(f"{key}_rms", f"{title}: error, rms", _finite(np.sqrt(np.mean(error**2))),
                     unit, lower, "Tracking")
        yield Metric(f"{key}_max_settled", f"{title}: after {by.settle:g} s, max",
                     _largest(error[after]), unit, lower, "Tracking")
        yield Metric(f"{key}_end", f"{title}: at the end", _finite(error[-1]), unit, lower,
                     "Tracking", detail=True)


def pointing_angle(recording: Recording) -> Array:
    """Return the angle between the pointing axis and the cone's axis: (T,) [deg]."""
    assert recording.scenario.pointing is not None
    cosine = np.cos(np.radians(recording.scenario.pointing.alpha_d)) - recording["pointing_error"]
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))


@_register("strictness")
def _strictness(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "moved_by_lower" in recording:
        moved = recording["moved_by_lower"]
        yield Metric("moved_by_lower_max", "Moved by lower tasks in a tick, max",
                     _finite(np.nanmax(moved)) if np.isfinite(moved).any() else None, "m",
                     group="Tracking", note="strict: not at all")


@_register("distances")
def _distances(recording: Recording, by: Criteria) -> Iterator[Metric]:
    for who, signal, label in (("body", "minimal_distance", "Body"),
                               ("ee", "ee_distance", "End effector")):
        if signal not in recording:
            continue
        apart, group = f"true_{signal}" in recording, "Safety"
        kept = _true(recording, signal)
        seen = not apart and recording.scenario.sensor.kind != "exact"
        yield Metric(f"{who}_distance_min", f"{label} distance, min", _least(kept), "m", False,
                     group, note="as measured: the true one is not known" if seen else "")
        yield from _below(recording, who, f"Time {label.lower()} is below its distance", kept)
        if apart:
            yield Metric(f"{who}_distance_min_measured", f"{label} distance measured, min",
                         _least(recording[signal]), "m", None, group, detail=True,
                         note="with the errors of the sensor")


def _below(recording: Recording, who: str, label: str, distance: Array) -> Iterator[Metric]:
    """Share of ticks below the distance that the scenario asks to keep, if it asks for one."""
    avoidance = recording.scenario.avoidance
    if avoidance is not None and who in avoidance.promised:
        promised, known = avoidance.promised[who], distance[~np.isnan(distance)]
        yield Metric(f"{who}_below_share", label,
                     float(np.mean(known < promised - _ON_IT)) if known.size else None, "share",
                     group="Safety", note=f"nearer than {promised:g} m")


@_register("contacts")
def _contacts(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "contacts" in recording:
        yield Metric("contact_ticks", "Contacts: ticks",
                     float(np.count_nonzero(recording["contacts"])), "", group="Safety")
        for key, unit in (("depth", "m"), ("force", "N")):
            yield Metric(f"contact_{key}_max", f"Contact {key}, max",
                         _largest(recording[f"contact_{key}"]), unit, group="Safety")


@_register("forces")
def _forces(recording: Recording, by: Criteria) -> Iterator[Metric]:
    from scenarios.measure import forces

    for number in forces.of_wanted_forces(recording, by.settle):
        yield Metric(*number, group="Contacts")
    for group, numbers in (("Contacts", forces.of_contacts), ("Torques", forces.of_torques),
                           ("Levels", forces.of_levels)):
        for number in numbers(recording):
            yield Metric(*number, group=group)


def _true(recording: Recording, signal: str) -> Array:
    """Return a signal as it was, where that is known apart from what was measured."""
    return recording[f"true_{signal}" if f"true_{signal}" in recording else signal]


@_register("motion")
def _motion(recording: Recording, by: Criteria) -> Iterator[Metric]:
    v, group = _true(recording, "v"), "Safety"
    yield _joint_limit_excess(recording)
    yield Metric("speed_max", "Joint speed, max", _largest(v), "rad/s", group=group)
    apart = "true_v" in recording
    yield Metric("velocity_step_max", "Joint speed step, max",
                 _largest(np.diff(v, axis=0)), "rad/s", group=group,
                 note="of the joints, not of the command")
    if apart:
        yield Metric("velocity_step_max_measured", "Joint speed step measured, max",
                     _largest(np.diff(recording["v"], axis=0)), "rad/s", None, group, detail=True,
                     note="with the errors of the sensor")
    if recording.scenario.control.level != "torque":
        yield Metric("command_step_max", "Commanded speed step, max", _command_step(recording),
                     "rad/s", group=group, note="of the command, not of the joints")
    yield Metric("acceleration_max", "Joint acceleration, max", _largest(recording["a"]),
                 "rad/s^2", group=group)
    yield Metric("acceleration_step_max", "Joint acceleration step, max",
                 _largest(np.diff(recording["a"], axis=0)), "rad/s^2", group=group)


def _command_step(recording: Recording) -> float | None:
    """Return the largest change of a joint's commanded speed in one tick [rad/s]."""
    control, command = recording.scenario.control, recording["command"]
    return _largest(np.diff(command, axis=0) if control.level == "velocity"
                    else command * control.period)


def _joint_limit_excess(recording: Recording) -> Metric:
    value, note = None, "the robot has no joint limits"
    if "joint_lower" in recording and "joint_upper" in recording:
        lower, upper, q = (recording["joint_lower"], recording["joint_upper"],
                           _true(recording, "q"))
        if np.isfinite(lower).any() or np.isfinite(upper).any():
            excess = passed(np.maximum(np.maximum(q - upper, lower - q), 0.0)).max(axis=0)
            joint = int(np.argmax(excess))
            value = _finite(excess[joint])
            note = f"joint {joint + 1}" if excess[joint] > 0.0 else ""
    return Metric("joint_limit_excess", "Beyond a joint limit, max", value, "rad",
                  group="Safety", note=note)


def passed(off: Array, tolerance: float = 0.0) -> Array:
    """Return by how much a limit is passed, from how far beyond it a run is (T, ...), at least 0.

    Who begins beyond it and comes back has not passed it, unless by going further.
    """
    came_back = (off <= tolerance).any(axis=0)
    return np.asarray(np.where(came_back, off - np.fmin.accumulate(off), off))


_AFTER = 0.5  # [s] after the return within reach that do not count as error


@_register("returning")
def _returning(recording: Recording, by: Criteria) -> Iterator[Metric]:
    """Metrics of runs whose path leaves the workspace: freezes, jerk, limits, the way back."""
    from scenarios.measure.returning import frozen, jerk, returned

    found = _left_path(recording)
    if found is None:
        return
    spans, error = found
    t, v, group = recording["t"], _true(recording, "v"), "Singularities"
    yield Metric("ticks_frozen", "Ticks frozen", float(frozen(t, v, error, spans).sum()), "",
                 group=group, note="still and off a path within reach")
    back = error[returned(t, spans, _AFTER)]
    yield Metric("error_returned_rms", "Error after return, rms",
                 _finite(np.sqrt(np.mean(back**2))) if back.size else None, "m", group=group)
    yield Metric("error_returned_max", "Error after return, max", _largest(back), "m", group=group,
                 note=f"from {_AFTER:g} s after the path is within reach")
    rate = jerk(t, recording["a"])
    yield Metric("jerk_rms", "Joint jerk, rms",
                 _finite(np.sqrt(np.mean(rate**2))) if rate.size else None, "rad/s^3", group=group)
    yield Metric("jerk_max", "Joint jerk, max", _largest(rate), "rad/s^3", group=group)
    if "velocity_limit" in recording:
        excess = np.maximum(np.abs(v) - recording["velocity_limit"], 0.0)
        yield Metric("speed_limit_excess", "Beyond a speed limit, max", _largest(excess), "rad/s",
                     group=group)


def _left_path(recording: Recording) -> tuple[tuple[tuple[float, float], ...], Array] | None:
    """Return when the first path that leaves the workspace does so, and the error (T,) from it."""
    from scenarios.recording.listed import errors

    scenario = recording.scenario
    path = scenario.position.path if scenario.position else None
    if path is not None and path.out_of_reach and "position_error" in recording:
        return path.out_of_reach, np.linalg.norm(recording["position_error"], axis=1)
    for section, unit, error in errors(recording):
        path = getattr(section, "path", None)
        if unit == "m" and path is not None and path.out_of_reach:
            return path.out_of_reach, error
    return None


@_register("switching")
def _switching(recording: Recording, by: Criteria) -> Iterator[Metric]:
    yield Metric("stack_changes", "Changes of the stack", float(recording.switches().size), "",
                 group="Switching")
    if "active_set" in recording or recording.facts.asks != "equalities":
        yield Metric("active_set_changes", "Changes of the active set", _set_changes(recording),
                     "", None, "Switching",
                     note="of the inequality rows that act, where the resolver reports them")
    if "active_control_point" in recording:
        changes = np.count_nonzero(np.diff(recording["active_control_point"].astype(int)))
        yield Metric("active_point_changes", "Changes of the active point",
                     float(changes), "", group="Switching")


def _set_changes(recording: Recording) -> float | None:
    if "active_set" not in recording:
        return None
    known = recording["active_set"][recording["active_set"] >= 0]
    return float(np.count_nonzero(np.diff(known)))


_DONE = {"brake": "Ticks braked", "hold": "Ticks with the last command held",
         "use": "Ticks with trouble, answer sent", "stop": "Ticks that stopped the run",
         "clamp": "Ticks clamped to the limits"}


@_register("troubles")
def _troubles(recording: Recording, by: Criteria) -> Iterator[Metric]:
    for action, label in _DONE.items():
        ticks = {event.tick for event in recording.events if event.action == action}
        if ticks:
            yield Metric(f"ticks_{action}", label, float(len(ticks)), "", group="Computing")


@_register("time")
def _time(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "status" in recording:
        from solvers import Status
        failed = np.count_nonzero(recording["status"] != int(Status.SOLVED))
        yield Metric("ticks_not_solved", "Ticks not solved", float(failed), "", group="Computing")
    if "time_tick" in recording:
        late = np.count_nonzero(recording["time_tick"] > recording.scenario.control.period)
        yield Metric("ticks_late", "Ticks longer than the period", float(late), "",
                     group="Computing")
    parts = (("time_tick", "Whole tick"), ("time_kinematics", "Kinematics"), ("time_rows", "Rows"),
             ("time_resolve", "Resolve"))
    levels = (("median", 50.0, "median"), ("p95", 95.0, "95 %"), ("p999", 99.9, "99.9 %"))
    for signal, part in parts:
        shared = signal in ("time_kinematics", "time_rows")  # the same code under any resolver
        for key, percent, label in levels if signal in recording else ():
            yield Metric(f"{signal}_{key}", f"{part}, {label}",
                         _finite(np.percentile(recording[signal], percent)), "s",
                         lower_is_better=None if shared else True, group="Computing",
                         detail=shared and key != "median")


def _largest(values: Array) -> float | None:
    return _finite(np.abs(values).max()) if values.size else None


def _least(values: Array) -> float | None:
    known = values[~np.isnan(values)]
    return _finite(known.min()) if known.size else None


def _finite(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
