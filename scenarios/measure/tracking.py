"""How near a run was to its targets, and how it went out of reach of its path and came back."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from scenarios.measure.metric import (
    Criteria,
    Metric,
    finite,
    known,
    largest,
    norms,
    register,
    rms_and_max,
    true,
)
from scenarios.recording import listed
from scenarios.recording.recording import Recording

STILL = 0.01     # largest joint speed [rad/s] of a robot that counts as standing still
FAR = 0.01       # error [m] at which it should not
_AFTER = 0.5     # [s] after the return within reach that do not count as error
_NOTHING = 1e-9  # errors of listed tasks below this are rounding and count as zero [m, deg, rad]

Mask = NDArray[np.bool_]
Spans = Sequence[tuple[float, float]]
_metric = partial(Metric, group="Tracking")


@register("tracking")
def _tracking(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "position_error" not in recording:
        return
    error, metrics = norms(recording["position_error"]), partial(rms_and_max, group="Tracking")
    after = error[recording["t"] - recording["t"][0] >= by.settle]
    settled = f"Error after {by.settle:g} s"
    yield from metrics("position_error", "Position error", error, "m")
    yield from metrics("position_error", settled, after, "m", suffix="_settled")
    yield _metric("position_error_median_settled", f"{settled}, median",
                  finite(np.median(after)) if after.size else None, "m")
    if "true_ee_position" in recording:
        error = norms(recording["desired_position"] - recording["true_ee_position"])
        yield from metrics("true_position_error", "True position error", error, "m")


@register("pointing")
def _pointing(recording: Recording, by: Criteria) -> Iterator[Metric]:
    pointing = recording.scenario.pointing
    if "pointing_error" not in recording or pointing is None:
        return
    half_angle = pointing.alpha_d
    beyond = pointing.angle(recording["pointing_error"]) - half_angle
    yield _metric("cone_violation_max", "Beyond the cone, max",
                  finite(max(float(beyond.max()), 0.0)), "deg", note=f"a cone of {half_angle:g}°")
    yield _metric("cone_violation_share", "Time outside the cone",
                  float(np.mean(beyond > by.cone_tolerance_deg)), "share",
                  note=f"outside by more than {by.cone_tolerance_deg:g}°")


@register("listed")
def _listed(recording: Recording, by: Criteria) -> Iterator[Metric]:
    """Errors of the tasks of `[[tasks]]`, each under its name."""
    after = recording["t"] - recording["t"][0] >= by.settle
    for section, unit, exact in listed.errors(recording):
        error = np.where(exact < _NOTHING, 0.0, exact)
        turned = unit == "deg" and section.kind in ("pose", "frame", "relative")
        title = section.title[0].upper() + section.title[1:] + (", turned" if turned else "")
        key = f"task_{section.title}{' turned' if turned else ''}".replace(" ", "_")
        lower = None if section.kind == "posture" else True  # it gets what is left
        yield _metric(f"{key}_rms", f"{title}: error, rms",
                      finite(np.sqrt(np.mean(error**2))), unit, lower)
        yield _metric(f"{key}_max_settled", f"{title}: after {by.settle:g} s, max",
                      largest(error[after]), unit, lower)
        yield _metric(f"{key}_end", f"{title}: at the end", finite(error[-1]), unit, lower,
                      detail=True)


@register("strictness")
def _strictness(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "moved_by_lower" in recording:
        yield _metric("moved_by_lower_max", "Moved by lower tasks in a tick, max",
                      largest(known(recording["moved_by_lower"])), "m", note="strict: not at all")


@register("returning")
def _returning(recording: Recording, by: Criteria) -> Iterator[Metric]:
    """Metrics of runs whose path leaves the workspace: freezes, jerk, limits, the way back."""
    found = _left_path(recording)
    if found is None:
        return
    spans, error = found
    t, v, group = recording["t"], true(recording, "v"), "Singularities"
    yield Metric("ticks_frozen", "Ticks frozen", float(frozen(t, v, error, spans).sum()), "",
                 group=group, note="still and off a path within reach")
    yield from rms_and_max("error_returned", "Error after return",
                           error[returned(t, spans, _AFTER)], "m", group=group,
                           note=f"from {_AFTER:g} s after the path is within reach")
    yield from rms_and_max("jerk", "Joint jerk", jerk(t, recording["a"]), "rad/s^3", group=group)
    if "velocity_limit" in recording:
        excess = np.maximum(np.abs(v) - recording["velocity_limit"], 0.0)
        yield Metric("speed_limit_excess", "Beyond a speed limit, max", largest(excess), "rad/s",
                     group=group)


def _left_path(recording: Recording) -> tuple[Spans, Array] | None:
    """Return when the first path that leaves the workspace does so, and the error (T,) from it."""
    position = recording.scenario.position
    path = position.path if position else None
    if path is not None and path.out_of_reach and "position_error" in recording:
        return path.out_of_reach, norms(recording["position_error"])
    for section, unit, error in listed.errors(recording):
        path = getattr(section, "path", None)
        if unit == "m" and path is not None and path.out_of_reach:
            return path.out_of_reach, error
    return None


def within_reach(t: Array, out_of_reach: Spans, after: float = 0.0) -> Mask:
    """Return which times t (T,) [s] are in no span, nor within `after` [s] of the end of one."""
    reach = np.ones(len(t), dtype=bool)
    for begin, end in out_of_reach:
        reach &= (t < begin) | (t > end + after)
    return reach


def returned(t: Array, out_of_reach: Spans, after: float) -> Mask:
    """Return which times t (T,) are within reach, `after` [s] or more after a span's end."""
    first = min((end for _, end in out_of_reach), default=np.inf)
    return within_reach(t, out_of_reach, after) & (t > first + after)


def frozen(t: Array, v: Array, error: Array, out_of_reach: Spans) -> Mask:
    """Return in which ticks the robot stands still, v (T, n), off a path that is within reach.

    It stands still if no joint is faster than STILL; it is off the path if the error (T,) exceeds
    FAR.
    """
    still = np.abs(v).max(axis=1, initial=0.0) < STILL
    return np.asarray(still & (error > FAR) & within_reach(t, out_of_reach))


def jerk(t: Array, a: Array) -> Array:
    """Return the differences of a (T, n) over those of t (T,): (T - 1, n) [rad/s^3]."""
    return np.asarray(np.diff(a, axis=0) / np.diff(t)[:, None])
