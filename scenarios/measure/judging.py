"""Completes a Recording after its last tick, so that readers need no robot."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hierarchy.avoidance import Measurement
from hierarchy.contacts import Contacts
from hierarchy.jit import compiled
from hierarchy.problem import Array, Hierarchy
from scenarios.cell.build import Cell, build
from scenarios.cell.sensors import DepthSensor
from scenarios.config.plant import KinematicSection
from scenarios.recording.depth_view import DepthView
from scenarios.recording.fate import Fates
from scenarios.recording.recording import Recording

_SAME = 1e-9  # [m] of distances that are those recorded


def completed(recording: Recording, cell: Cell) -> Recording:
    """Return a run with the fates of its levels and, if it has a camera, a depth image.

    `cell` is built from the run's scenario; its state is moved, its plant is not used.
    """
    if recording.scenario.sensor.kind == "exact":
        judge(recording, cell)
    return replace(recording, depth=depth_view(recording))


def judge(recording: Recording, cell: Cell) -> None:
    """Write the rows of every tick again and judge the command that was sent by them.

    Adds the signals level_fate, level_violation and saturated. Levels are UNKNOWN in ticks whose
    distances do not follow from the recorded joints, or whose settings were changed by hand.
    """
    orders, rows = recording.order_names, Rows(recording, cell)
    fates = Fates(recording.task_names, recording.ticks, cell.robot.n)
    accuracy, commands = recording.facts.resolver.accuracy, _meant(recording)
    changed = recording.get("changed", np.zeros(recording.ticks, bool))
    for k, index in enumerate(recording["order"].tolist()):
        order = orders[index]
        h = rows.hierarchy(k, order) if order and not changed[k] else None
        if h is not None and not np.isnan(commands[k, 0]):
            fates.judge(k, cell, h, commands[k], accuracy)
    recording.signals.update(fates.signals(recording))


def _meant(recording: Recording) -> Array:
    """Return what the commands stand for in the rows: at level "torque" the answers."""
    if recording.scenario.control.level != "torque":
        return recording["command"]
    forces = recording["planned_force"].reshape(recording.ticks, -1)
    return np.hstack([recording["planned_acceleration"], forces])


def _carried(recording: Recording, contacts: Contacts) -> list[Array | None]:
    """Return what the contacts carried before each tick, see `Contacts.carried`."""
    found: list[Array | None] = [None]
    for t, x in zip(recording["t"].tolist(), _meant(recording), strict=True):
        found.append(found[-1] if np.isnan(x[0]) else contacts.carried(t, x, found[-1]))
    return found


class Rows:
    """Moves a cell through the recorded ticks."""

    def __init__(self, recording: Recording, cell: Cell) -> None:
        self._cell = cell
        self._t = recording["t"].tolist()
        self._q, self._v, self._command = (recording[name] for name in ("q", "v", "command"))
        level = recording.scenario.control.level
        self._follows = level != "acceleration"  # whether rows depend on the last command
        self._first = self._v[0] if level == "velocity" else None
        self._carried = _carried(recording, cell.contacts) if cell.contacts else ()
        self._cone_error = cell.pointing.follow_cone_error(cell.state) if cell.pointing else None
        if "ee_distance" in recording:
            self._distance = np.column_stack([recording["control_point_distance"],
                                              recording["ee_distance"]])

    def hierarchy(self, k: int, order: tuple[str, ...]) -> Hierarchy | None:
        """Return the rows of tick k, valid until the next; None if they differ from the run's."""
        t, q, v, cell = self._t, self._q, self._v, self._cell
        if cell.state.period > 0.0:  # differences are against the tick before
            cell.state.move(t[max(k - 1, 0)], q[max(k - 1, 0)], v[max(k - 1, 0)])
        if not cell.state.move(t[k], q[k], v[k]):
            return None
        if self._follows:
            cell.state.commanded = self._command[k - 1] if k else self._first
        if self._carried:
            cell.state.carried = self._carried[k]
        cone = self._cone_error() if self._cone_error else float("nan")
        seen = cell.sensor.measure(cell.state) if cell.sensor else None
        if not self._is_as_recorded(k, seen) or cell.order(seen, cone).order != order:
            return None
        return cell.stack.hierarchy(cell.state, order)

    def _is_as_recorded(self, k: int, seen: Measurement | None) -> bool:
        return seen is None or bool(_alike(seen.distance, self._distance[k], _SAME))


@compiled
def _alike(values, others, within):
    """Whether two arrays agree to `within`; infinite entries agree, NaN agrees with nothing."""
    for i in range(len(values)):
        if not (values[i] == others[i] or abs(values[i] - others[i]) <= within):
            return False
    return True


def depth_view(recording: Recording, t: float | None = None) -> DepthView | None:
    """Take the image of a run's camera at time t [s]; None without a camera or before its first.

    The default is the tick in which the end effector is nearest to an obstacle, or the last tick if
    no obstacle was seen. The camera is built from the scenario, with zero latency.
    """
    if recording.scenario.sensor.kind != "camera" or not recording.ticks:
        return None
    k = _nearest(recording) if t is None else int(np.argmin(np.abs(recording["t"] - t)))
    sensor = recording.scenario.sensor.model_copy(update={"latency": 0.0})
    at_rest = {"sensor": sensor, "plant": KinematicSection()}
    cell = build(recording.scenario.model_copy(update=at_rest))
    moved = cell.state.move(float(recording["t"][k]), recording["q"][k], recording["v"][k])
    if not moved or not isinstance(cell.sensor, DepthSensor):
        return None
    seen, image = cell.sensor.measure(cell.state), cell.sensor.reading
    return None if image is None else DepthView(
        cell.state.t, image.copy(), cell.sensor.space.pinhole.packed(), seen.points.copy(),
        seen.distance.copy(), seen.nearest.copy(), seen.active)


def _nearest(recording: Recording) -> int:
    distance = np.where(np.isnan(recording["ee_distance"]), np.inf, recording["ee_distance"])
    return int(np.argmin(distance)) if np.isfinite(distance).any() else recording.ticks - 1
