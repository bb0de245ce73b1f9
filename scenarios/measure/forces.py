"""Numbers about runs with contact forces: slip, margins, torques, and what each level missed."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from hierarchy.problem import Array
from scenarios.config.kinds import ListedForce
from scenarios.measure.metric import Criteria, Metric, known, largest, least, register, true
from scenarios.measure.safety import steps
from scenarios.recording.recording import Recording

_LOAD = 1.0        # [N] from which a contact counts as loaded
_AT_LIMIT = 0.999  # share of a torque limit that counts as being at it
_BEYOND = 0.01     # [rad] by which a joint may press into its stop
REST = 2.0         # [s] at the end of a run in which a robot is to stand at rest
CALM, SUNK = 0.2, 0.05  # largest joint speed [rad/s], and [m] below its start, of one that does


@register("forces")
def _forces(recording: Recording, by: Criteria) -> Iterator[Metric]:
    if "floor_force" in recording:
        yield from _wanted(recording, by.settle)
        if recording["floor_force"].size:
            yield from _contacts(recording)
    if recording.scenario.control.level == "torque":
        yield from _torques(recording)
        names = recording.task_names if "level_violation" in recording else ()
        for column, name in enumerate(names):
            missed = known(recording["level_violation"][:, column])
            yield Metric(f"miss_{name.replace(' ', '_')}", f"Missed by {name}, mean",
                         float(missed.mean()) if missed.size else None, "rows", group="Levels")


def _contacts(recording: Recording) -> Iterator[Metric]:
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
                     float(np.sqrt(np.mean(error**2))), "N", group="Contacts")
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
    if "torque_limit" in recording:
        at = (np.abs(torque) >= _AT_LIMIT * recording["torque_limit"]).any(axis=1)
        yield metric("torque_limit_share", "Time with a torque at its limit", float(at.mean()),
                     "share")
    yield from steps("torque", "Torque", torque, "N m", group="Torques")
    if "com" in recording:
        height = recording["com"][:, 2]
        yield metric("com_drop_max", "Centre of mass below its start, max",
                     float(height[0] - height.min()), "m")
        moved = np.linalg.norm((recording["com"][-1] - recording["com"][0])[:2])
        stands = standing(recording)
        if stands is not None:
            yield metric("stands_at_rest", f"Stands at rest in the last {REST:g} s",
                         float(stands), "", False,
                         note=f"joints below {CALM:g} rad/s, less than {SUNK:g} m below its start")
        yield metric("com_travel", "Centre of mass from start to end", float(moved), "m", None)


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
    q, height = true(recording, "q")[last], recording["com"][:, 2]
    beyond = np.maximum(q - recording["joint_upper"], recording["joint_lower"] - q)
    return recording.fault is None and bool(
        np.abs(true(recording, "v")[last]).max() < CALM and beyond.max() < _BEYOND
        and height[0] - height[last].min() < SUNK and (recording["support_margin"][last] > 0).all())
