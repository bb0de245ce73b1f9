"""Distances, touches, limits, and how fast and how jerkily the joints moved."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from hierarchy.problem import Array
from scenarios.measure.metric import Criteria, Metric, known, largest, least, passed, register, true
from scenarios.recording.recording import Recording

_ON_IT = 1e-4  # [m] below a distance that still counts as keeping it
STEPS = {"rad/s": 0.1, "rad/s^2": 50.0, "N m": 5.0}  # from one tick to the next: larger ones count

_metric = partial(Metric, group="Safety")


@register("distances")
def _distances(recording: Recording, by: Criteria) -> Iterator[Metric]:
    for who, signal, label in (("body", "minimal_distance", "Body"),
                               ("ee", "ee_distance", "End effector")):
        if signal not in recording:
            continue
        apart, kept = f"true_{signal}" in recording, true(recording, signal)
        seen = not apart and recording.scenario.sensor.kind != "exact"
        yield _metric(f"{who}_distance_min", f"{label} distance, min", least(kept), "m", False,
                      note="as measured: the true one is not known" if seen else "")
        avoidance = recording.scenario.avoidance
        if avoidance is not None and who in avoidance.promised:
            promised, sure = avoidance.promised[who], kept[~np.isnan(kept)]
            yield _metric(f"{who}_below_share", f"Time {label.lower()} is below its distance",
                          float(np.mean(sure < promised - _ON_IT)) if sure.size else None, "share",
                          note=f"nearer than {promised:g} m")
        if apart:
            yield _metric(f"{who}_distance_min_measured", f"{label} distance measured, min",
                          least(recording[signal]), "m", None, detail=True,
                          note="with the errors of the sensor")


@register("contacts")
def _contacts(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "contacts" in recording:
        yield _metric("contact_ticks", "Contacts: ticks",
                      float(np.count_nonzero(recording["contacts"])), "")
        for key, unit in (("depth", "m"), ("force", "N")):
            yield _metric(f"contact_{key}_max", f"Contact {key}, max",
                          largest(recording[f"contact_{key}"]), unit)


@register("motion")
def _motion(recording: Recording, by: Criteria) -> Iterator[Metric]:
    v = true(recording, "v")
    yield _joint_limit_excess(recording)
    yield _metric("speed_max", "Joint speed, max", largest(v), "rad/s")
    yield from steps("velocity", "Joint speed", v, "rad/s", "of the joints, not of the command")
    if "true_v" in recording:
        yield _metric("velocity_step_max_measured", "Joint speed step measured, max",
                      largest(np.diff(recording["v"], axis=0)), "rad/s", None, detail=True,
                      note="with the errors of the sensor")
    control, command = recording.scenario.control, recording["command"]
    if control.level != "torque":
        yield _metric("command_step_max", "Commanded speed step, max",
                      largest(np.diff(command, axis=0) if control.level == "velocity" else
                              command * control.period), "rad/s",
                      note="of the command, not of the joints")
    yield _metric("acceleration_max", "Joint acceleration, max", largest(recording["a"]),
                  "rad/s^2")
    yield from steps("acceleration", "Joint acceleration", recording["a"], "rad/s^2")


def steps(key: str, label: str, values: Array, unit: str, note: str = "", group: str = "Safety"
          ) -> Iterator[Metric]:
    """Yield the largest step of values (T, n) between two ticks, and the ticks with large ones."""
    step, bound = np.abs(np.diff(values, axis=0)), STEPS[unit]
    yield Metric(f"{key}_step_max", f"{label} step, max", largest(known(step)), unit, group=group,
                 note=note)
    large = float(np.count_nonzero((step > bound).any(axis=1)))
    yield Metric(f"{key}_step_ticks", f"{label} steps above {bound:g} {unit.replace('^2', '²')}",
                 large, "", group=group, note="ticks")


def _joint_limit_excess(recording: Recording) -> Metric:
    value, note = None, "the robot has no joint limits"
    if "joint_lower" in recording and "joint_upper" in recording:
        lower, upper, q = (recording["joint_lower"], recording["joint_upper"],
                           true(recording, "q"))
        if np.isfinite(lower).any() or np.isfinite(upper).any():
            excess = passed(np.maximum(np.maximum(q - upper, lower - q), 0.0)).max(axis=0)
            joint = int(np.argmax(excess))
            value = largest(excess)
            note = f"joint {joint + 1}" if excess[joint] > 0.0 else ""
    return _metric("joint_limit_excess", "Beyond a joint limit, max", value, "rad", note=note)
