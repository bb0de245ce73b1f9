"""Numbers about runs with contact forces: slip, margins, torques, and what each level missed."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording

Array = NDArray[np.float64]
_LOAD = 1.0        # [N] from which a contact counts as loaded
_AT_LIMIT = 0.999  # share of a torque limit that counts as being at it


class Number(NamedTuple):
    """One number of a run, as the first fields of a Metric."""

    name: str
    label: str
    value: float | None
    unit: str
    lower_is_better: bool | None = True


def of_contacts(recording: Recording) -> Iterator[Number]:
    """Yield what the floor says: slip, margins of friction and of the centre of pressure."""
    if "floor_force" not in recording or not recording["floor_force"].size:
        return
    if not all(contact.slides for contact in recording.scenario.contacts):
        yield Number("slip_max", "Slip of a contact, max", _largest(recording["slip"]), "m")
        yield Number("friction_margin_min", "Friction left, min", _least(friction_left(recording)),
                     "share", False)
    if np.isfinite(recording["pressure_margin"]).any():
        yield Number("pressure_margin_min", "Centre of pressure from the edge, min",
                     _least(recording["pressure_margin"]), "m", False)
    if np.isfinite(recording["support_margin"]).any():
        yield Number("support_margin_min", "Centre of mass inside the support polygon, min",
                     _least(recording["support_margin"]), "m", False)
    error = force_error(recording)
    yield Number("force_error_p95", "Force of a contact against that planned, 95 %",
                 float(np.percentile(error, 95.0)) if error.size else None, "N")


def of_wanted_forces(recording: Recording, settle: float) -> Iterator[Number]:
    """Yield how well contacts push with the normal force that a task asks for, after `settle` [s].

    The surface is horizontal, as in the plant.
    """
    if "floor_force" not in recording:
        return
    from scenarios.config.kinds.forces import ListedForce

    names = [contact.name or contact.frame for contact in recording.scenario.contacts]
    after = recording["t"] >= settle
    for task in recording.scenario.tasks:
        if isinstance(task, ListedForce) and len(task.target) == 1 and after.any():
            force = recording["floor_force"][after, names.index(task.contact), 2]
            key, title = task.title.replace(" ", "_"), f"{task.title[0].upper()}{task.title[1:]}"
            yield Number(f"{key}_rms", f"{title}: error after {settle:g} s, rms",
                         float(np.sqrt(np.mean((force - task.target[0])**2))), "N")
            yield Number(f"{key}_touching_share", f"{title}: time in contact after {settle:g} s",
                         float(np.mean(force > 0.0)), "share", False)


def of_torques(recording: Recording) -> Iterator[Number]:
    """Yield how near to their limits the torques are, and how they jump."""
    if recording.scenario.control.level != "torque":
        return
    torque = recording["command"]
    if "torque_limit" in recording:
        at = (np.abs(torque) >= _AT_LIMIT * recording["torque_limit"]).any(axis=1)
        yield Number("torque_limit_share", "Time with a torque at its limit", float(at.mean()),
                     "share")
    yield Number("torque_step_max", "Torque step, max", _largest(np.diff(torque, axis=0)), "N m")
    if "com" in recording:
        height = recording["com"][:, 2]
        yield Number("com_drop_max", "Centre of mass below its start, max",
                     float(height[0] - height.min()), "m")
        moved = np.linalg.norm((recording["com"][-1] - recording["com"][0])[:2])
        yield Number("com_travel", "Centre of mass from start to end", float(moved), "m", None)


def of_levels(recording: Recording) -> Iterator[Number]:
    """Yield by how much each level is missed, on average over the ticks in which it is known."""
    if recording.scenario.control.level != "torque" or "level_violation" not in recording:
        return
    missed = recording["level_violation"]
    for name, column in zip(recording.task_names, missed.T, strict=True):
        known = column[np.isfinite(column)]
        mean = float(known.mean()) if known.size else None
        yield Number(f"miss_{name.replace(' ', '_')}", f"Missed by {name}, mean", mean, "rows")


def friction_left(recording: Recording) -> Array:
    """Return 1 - |f_t| / (mu f_n) of loaded contacts (T, C) that do not slide; NaN elsewhere."""
    force = recording["floor_force"]
    normal, along = force[:, :, 2], np.linalg.norm(force[:, :, :2], axis=2)
    mu = getattr(recording.scenario.plant, "friction", np.nan)
    sticks = np.array([not contact.slides for contact in recording.scenario.contacts])
    left = 1.0 - along / (mu * np.maximum(normal, _LOAD))
    return np.where(sticks & (normal > _LOAD), left, np.nan)


def force_error(recording: Recording) -> Array:
    """Return the largest component [N] of floor_force against planned, in ticks without push."""
    planned, at = recording["planned_force"], 0
    sums = np.empty_like(recording["floor_force"])
    for c, contact in enumerate(recording.scenario.contacts):
        count = 1 if contact.x is None else 4
        sums[:, c] = planned[:, at:at + count].sum(axis=1)
        at += count
    error: Array = np.abs(recording["floor_force"] - sums).max(axis=(1, 2))
    return error[np.isfinite(error) & ~recording["push"].any(axis=1)]


def _largest(values: Array) -> float | None:
    known = np.abs(values[np.isfinite(values)])
    return float(known.max()) if known.size else None


def _least(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.min()) if known.size else None
