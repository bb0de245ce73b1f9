"""Distances, touches, limits, how jerkily joints moved; slip, margins and torques on contacts."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from hierarchy.problem import Array
from scenarios.config.sections.kinds import ListedForce
from scenarios.measure.metric import (
    Criteria,
    Metric,
    finite,
    known,
    largest,
    least,
    passed,
    register,
)
from scenarios.recording.recording import Recording

_ON_IT = 1e-4  # [m] below a distance that still counts as keeping it
_STEPS = {"velocity": 0.1, "acceleration": 50.0, "torque": 5.0}
"""[rad/s, rad/s^2, N m] or the same with m and N, from one tick to the next: larger ones count."""
_ROUNDING = 1e-9   # of such a step that still counts as not larger, as at a limit of acceleration
_LOAD = 1.0        # [N] from which a contact counts as loaded
_ZERO = 1e-12      # of a share: rounding
_AT_LIMIT = 0.999  # share of a torque limit that counts as being at it
_BEYOND = 0.01     # [rad] by which a joint may press into its stop
REST = 2.0         # [s] at the end of a run in which a robot is to stand at rest
CALM, SUNK = 0.2, 0.05  # largest joint speed [rad/s], and [m] below its start, of one that does

_metric = partial(Metric, group="Safety")


@register("distances")
def _distances(recording: Recording, by: Criteria) -> Iterator[Metric]:
    for who, signal, label in (("body", "minimal_distance", "Body"),
                               ("ee", "ee_distance", "End effector")):
        if signal not in recording:
            continue
        apart, kept = f"true_{signal}" in recording, recording.true(signal)
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
    control, first = recording.scenario.control, recording.facts.robot.actuated
    v, a, command = (values[:, first:] for values in (
        recording.true("v"), recording["a"], recording["command"]))
    speed, rate = units_of(recording, "/s"), units_of(recording, "/s^2")
    yield _joint_limit_excess(recording)
    yield _metric("speed_max", "Joint speed, max", largest(v), speed)
    yield from steps("velocity", "Joint speed", v, speed, "of the joints, not of the command")
    if "true_v" in recording:
        yield _metric("velocity_step_max_measured", "Joint speed step measured, max",
                      largest(np.diff(recording["v"][:, first:], axis=0)), speed, None, detail=True,
                      note="with the errors of the sensor")
    commanded = "of the command, not of the joints"
    meant = "" if recording.scenario.plant.follows or control.level == "torque" else commanded
    if control.level != "torque":
        yield _metric("command_step_max", "Commanded speed step, max",
                      largest(np.diff(command, axis=0) if control.level == "velocity" else
                              command * control.period), speed,
                      note=commanded)
    yield _metric("acceleration_max", "Joint acceleration, max", largest(a), rate, note=meant)
    yield from steps("acceleration", "Joint acceleration", a, rate, meant)


def units_of(recording: Recording, per: str = "") -> str:
    """Return the units of the joints, "rad", "m" or "rad or m", each `per` something."""
    robot = recording.facts.robot
    joints = robot.velocity_units[robot.actuated:]
    return " or ".join(f"{unit}{per}" for unit in sorted({*joints}, reverse=True)) or f"rad{per}"


def counted_from(level: str) -> float:
    """Return the step of a command of a level, in its unit, above which one is counted."""
    return _STEPS[level] * (1.0 + _ROUNDING)


def steps(key: str, label: str, values: Array, unit: str, note: str = "", group: str = "Safety"
          ) -> Iterator[Metric]:
    """Yield the largest step of values (T, n) between two ticks, and the ticks with large ones."""
    step, bound = np.abs(np.diff(values, axis=0)), _STEPS[key]
    yield Metric(f"{key}_step_max", f"{label} step, max", largest(known(step)), unit, group=group,
                 note=note)
    large = float(np.count_nonzero((step > counted_from(key)).any(axis=1)))
    yield Metric(f"{key}_step_ticks", f"{label} steps above {bound:g} {unit.replace('^2', '²')}",
                 large, "", group=group, note="ticks")


def _joint_limit_excess(recording: Recording) -> Metric:
    value, note = None, "the robot has no joint limits"
    lower, upper, q = recording["joint_lower"], recording["joint_upper"], recording.true("q")
    if np.isfinite(lower).any() or np.isfinite(upper).any():
        excess = passed(np.maximum(np.maximum(q - upper, lower - q), 0.0)).max(axis=0)
        joint = int(np.argmax(excess))
        value = largest(excess)
        note = recording.facts.robot.coordinate_names[joint] if excess[joint] > 0.0 else ""
    return _metric("joint_limit_excess", "Beyond a joint limit, max", value, units_of(recording),
                   note=note)


@register("forces")
def _forces(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "floor_force" in recording:
        yield from _wanted(recording, by.settle)
        if recording["floor_force"].size:
            yield from _floor(recording)
    if recording.scenario.control.level == "torque":
        yield from _torques(recording)
        names = recording.task_names if "level_violation" in recording else ()
        for column, name in enumerate(names):
            missed = known(recording["level_violation"][:, column])
            yield Metric(f"miss_{name.replace(' ', '_')}", f"Missed by {name}, mean",
                         float(missed.mean()) if missed.size else None, "rows", group="Levels")


def _floor(recording: Recording) -> Iterator[Metric]:
    """Yield what the floor says: slip, margins of friction and of the centre of pressure.

    Friction left is 1 - |f_t| / (mu f_n) of loaded contacts that do not slide. Forces are compared
    with those planned in ticks without a push, by their largest component.
    """
    metric, force = partial(Metric, group="Contacts"), recording["floor_force"]
    contacts = recording.scenario.contacts
    sticks = np.array([not contact.slides for contact in contacts])
    if sticks.any():
        normal, along = force[:, :, 2], np.linalg.norm(force[:, :, :2], axis=2)
        mu = getattr(recording.scenario.plant, "friction", np.nan)
        left = (1.0 - along / (mu * np.maximum(normal, _LOAD)))[sticks & (normal > _LOAD)]
        left[np.abs(left) < _ZERO] = 0.0  # at the cone
        yield metric("slip_max", "Slip of a contact, max", largest(known(recording["slip"])), "m")
        yield metric("friction_margin_min", "Friction left, min", least(known(left)), "share",
                     False)
    for key, label in (("pressure", "Centre of pressure from the edge"),
                       ("support", "Centre of mass inside the support polygon")):
        margin = known(recording[f"{key}_margin"])
        if margin.size:
            yield metric(f"{key}_margin_min", f"{label}, min", least(margin), "m", False)
    first = np.cumsum([0, *(1 if contact.x is None else 4 for contact in contacts[:-1])])
    planned = np.add.reduceat(recording["planned_force"], first, axis=1)
    error = known(np.abs(force - planned).max(axis=(1, 2))[~recording["push"].any(axis=1)])
    yield metric("force_error_p95", "Force of a contact against that planned, 95 %",
                 float(np.percentile(error, 95.0)) if error.size else None, "N")


def _wanted(recording: Recording, settle: float) -> Iterator[Metric]:
    """Yield how well contacts push with the normal force that a task asks for, after `settle`."""
    after = recording["t"] >= settle
    for task, force in wanted_forces(recording) if after.any() else ():
        key, title = task.title.replace(" ", "_"), f"{task.title[0].upper()}{task.title[1:]}"
        error = force[after] - task.target[0]
        yield Metric(f"{key}_rms", f"{title}: error after {settle:g} s, rms",
                     finite(np.sqrt(np.mean(error**2))), "N", group="Contacts")
        yield Metric(f"{key}_touching_share", f"{title}: time in contact after {settle:g} s",
                     float(np.mean(force[after] > 0.0)), "share", False, "Contacts")


def wanted_forces(recording: Recording) -> Iterator[tuple[ListedForce, Array]]:
    """Yield each task of a normal force with that force (T,) [N]; floors are horizontal."""
    names = [contact.name or contact.frame for contact in recording.scenario.contacts]
    for task in recording.scenario.tasks if "floor_force" in recording else ():
        if isinstance(task, ListedForce) and len(task.target) == 1:
            yield task, recording["floor_force"][:, names.index(task.contact), 2]


def _torques(recording: Recording) -> Iterator[Metric]:
    """Yield the largest use of the torque limits, and the largest torque steps."""
    torque, metric = recording["command"], partial(Metric, group="Torques")
    robot = recording.facts.robot
    if "torque_limit" in recording:
        at = (np.abs(torque) >= _AT_LIMIT * recording["torque_limit"]).any(axis=1)
        yield metric("torque_limit_share", "Time with a torque at its limit", float(at.mean()),
                     "share")
    units = sorted({*robot.effort_units[robot.actuated:]}, reverse=True)
    yield from steps("torque", "Torque", torque, " or ".join(units), group="Torques")
    if "com" in recording and robot.base == "floating":
        height = recording["com"][:, 2]
        yield metric("com_drop_max", "Centre of mass below its start, max",
                     finite(height[0] - height.min()), "m")
        moved = np.linalg.norm((recording["com"][-1] - recording["com"][0])[:2])
        stands = standing(recording)
        if stands is not None:
            yield metric("stands_at_rest", f"Stands at rest in the last {REST:g} s",
                         float(stands), "", False,
                         note=f"joints below {CALM:g} rad/s, less than {SUNK:g} m below its start")
        yield metric("com_travel", "Centre of mass from start to end", finite(moved), "m", None)


def standing(recording: Recording) -> bool | None:
    """Return whether a robot stands at rest in the last REST of its run; None if that is too short.

    Its joints are slower than CALM and within their limits, its centre of mass is less than SUNK
    below the start and inside the support polygon. A run that ends in a fault does not.
    """
    scenario, t = recording.scenario, recording["t"]
    pushed = max((push.at + push.duration for push in getattr(scenario.plant, "pushes", ())),
                 default=0.0)
    if scenario.control.duration < pushed + REST or not recording.ticks:
        return None
    last = t > scenario.control.duration - REST
    q, height = recording.true("q")[last], recording["com"][:, 2]
    beyond = np.maximum(q - recording["joint_upper"], recording["joint_lower"] - q)
    return recording.fault is None and bool(
        np.abs(recording.true("v")[last]).max() < CALM and beyond.max() < _BEYOND
        and height[0] - height[last].min() < SUNK and (recording["support_margin"][last] > 0).all())
