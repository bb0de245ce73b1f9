"""The fate of each level: the rows of every tick, and the command that was sent judged by them."""

from dataclasses import replace
from math import nan, sqrt
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.jit import compiled
from hierarchy.problem import Array, Hierarchy
from scenarios.cell.build import Cell, build
from scenarios.cell.sensors import DepthSensor
from scenarios.cell.sensors.camera import DepthCamera
from scenarios.config.sections.plant import KinematicSection
from scenarios.recording.blame import blamed
from scenarios.recording.fate import Fate
from scenarios.recording.recording import DepthView, Recording
from solvers.certificate import TOLERANCE

_SAME = 1e-9  # [m] of distances that are those recorded


@final
class Fates:
    """Collects the fates of the tasks called `names` tick by tick; `look` is an Audit of a run."""

    def __init__(self, names: tuple[str, ...], ticks: int, joints: int) -> None:
        self._names = names
        self._fate = np.zeros((ticks, len(names)), np.int8)
        self._violation = np.full((ticks, len(names)), np.nan)
        self._saturated = np.zeros((ticks, joints), np.int8)
        self._columns: dict[tuple[str, ...], NDArray[np.int64]] = {}

    def look(self, tick: int, controller: Any) -> dict[str, Array]:
        """Judge the command of the tick that a Controller has just answered."""
        self.judge(tick, controller.cell, controller.hierarchy, controller.meant,
                   controller.resolver.accuracy)
        return {}

    def judge(self, tick: int, cell: Cell, h: Hierarchy, x: Array, accuracy: float) -> None:
        """Judge a command x (n,) by the rows of its tick; `accuracy` is the resolver's.

        A row is on a side if it is as near to it as the resolver, or a certificate, may be.
        """
        near = max(TOLERANCE, accuracy) * (1.0 + sqrt(float(x @ x)))
        columns = self._columns.get(h.names)
        if columns is None:
            columns = np.array([self._names.index(name) for name in h.names], dtype=np.int64)
            self._columns[h.names] = columns
        fate, violation = np.zeros(len(columns), np.int8), np.zeros(len(columns))
        lower = h.lower if cell.activation is None else cell.activation.demanded(h)
        _judge_levels(h.A, lower, h.upper, h.offsets, x, near, fate, violation)
        self._fate[tick, columns], self._violation[tick, columns] = fate, violation
        if (limits := cell.tasks.limits) is not None:
            if limits.name in h.names:
                rows = slice(*h.offsets[h.names.index(limits.name):][:2])
                box = h.lower[rows], h.upper[rows]
            else:
                box = limits.box(cell.state, "velocity" if cell.stack.level == "velocity"
                                 else "acceleration")
            _find_saturated(x[:cell.robot.n], *box, near, self._saturated[tick])

    def signals(self, recording: Recording) -> dict[str, NDArray[np.int8] | Array]:
        """Return the signals of a Recording; levels that were not judged are UNKNOWN."""
        columns = [self._names.index(name) for name in recording.task_names]
        fate, rows = self._fate[:recording.ticks, columns], slice(recording.ticks)
        return {"level_fate": np.maximum(fate, np.int8(Fate.UNKNOWN) * recording.in_stack),
                "level_violation": self._violation[rows, columns],
                "saturated": self._saturated[rows]}


def completed(recording: Recording, cell: Cell) -> Recording:
    """Return a run with the states of its levels and, if it has a camera, a depth image.

    `cell` is built from the run's scenario; its state is moved, its plant is not used. Ctrl-C or an
    error ends it: the levels of the ticks that are left stay UNKNOWN.
    """
    try:
        if recording.scenario.sensor.kind == "exact":
            judge(recording, cell)
        return replace(recording, depth=depth_view(recording))
    except (KeyboardInterrupt, Exception) as error:
        why = "interrupted" if isinstance(error, KeyboardInterrupt) else blamed(error)
        return replace(recording, fault=recording.fault or f"{why} after the last tick")


def judge(recording: Recording, cell: Cell) -> None:
    """Write the rows of every tick again and judge the command that was sent by them.

    Adds the signals level_fate, level_violation and saturated. Levels are UNKNOWN in ticks whose
    distances do not follow from the recorded joints, or whose settings were changed by hand.
    """
    rows = Rows(recording, cell)
    fates = Fates(recording.task_names, recording.ticks, cell.robot.n)
    accuracy, commands = recording.facts.resolver.accuracy, rows.meant
    try:
        for k in range(recording.ticks):
            h = rows.hierarchy(k)
            if h is not None and not np.isnan(commands[k, 0]):
                fates.judge(k, cell, h, commands[k], accuracy)
    finally:
        recording.signals.update(fates.signals(recording))


class Rows:
    """Moves a cell through the recorded ticks.

    meant : (T, n) what the commands stand for in the rows: at level "torque" the answers.
    """

    def __init__(self, recording: Recording, cell: Cell) -> None:
        self._cell, level = cell, recording.scenario.control.level
        self._t = recording["t"].tolist()
        self._q, self._v, self._command = (recording[name] for name in ("q", "v", "command"))
        self._orders, self._order = recording.order_names, recording["order"].tolist()
        self._follows = level != "acceleration"  # whether rows depend on the last command
        self._first = self._v[0] if level == "velocity" else None
        self._carried: list[Array | None] = [None]  # by the contacts before each tick
        self._changed = recording.get("changed", np.zeros(recording.ticks, bool))
        self.meant = recording["command"] if level != "torque" else np.hstack([
            recording["planned_acceleration"],
            *recording["planned_force"].swapaxes(0, 1)])
        if cell.contacts:
            for t, x in zip(self._t, self.meant, strict=True):
                last = self._carried[-1]
                self._carried.append(
                    last if np.isnan(x[0]) else cell.contacts.carried(t, x, last))
        self._cone_error = (cell.tasks.pointing.follow_cone_error(cell.state) if cell.tasks.pointing
                            else lambda: nan)
        if "ee_distance" in recording:
            self._distance = np.column_stack([recording["control_point_distance"],
                                              recording["ee_distance"]])

    def hierarchy(self, k: int) -> Hierarchy | None:
        """Return the rows of tick k, valid until the next; None if they differ from the run's."""
        t, q, v, cell, order = self._t, self._q, self._v, self._cell, self._orders[self._order[k]]
        if not order or self._changed[k]:
            return None
        if cell.state.period > 0.0:  # differences are against the tick before
            cell.state.move(t[max(k - 1, 0)], q[max(k - 1, 0)], v[max(k - 1, 0)])
        if not cell.state.move(t[k], q[k], v[k]):
            return None
        if self._follows:
            cell.state.commanded = self._command[k - 1] if k else self._first
        if cell.contacts:
            cell.state.carried = self._carried[k]
        cone, seen = self._cone_error(), cell.sensor.measure(cell.state) if cell.sensor else None
        same = seen is None or _alike(seen.distance, self._distance[k], _SAME)
        if not same or cell.order(seen, cone).order != order:
            return None
        return cell.stack.hierarchy(cell.state, order)


def depth_view(recording: Recording) -> DepthView | None:
    """Take an image with a run's camera, without latency; None without one or before its first.

    That is in the tick in which the end effector is nearest to an obstacle, or the last tick if no
    obstacle was seen.
    """
    scenario = recording.scenario
    if scenario.sensor.kind != "camera" or not recording.ticks:
        return None
    off = np.nan_to_num(recording["ee_distance"], nan=np.inf, posinf=np.inf)
    k = int(np.argmin(off)) if np.isfinite(off).any() else recording.ticks - 1
    sensor = scenario.sensor.model_copy(update={"latency": 0.0})
    cell = build(scenario.model_copy(update={"sensor": sensor, "plant": KinematicSection()}))
    moved = cell.state.move(float(recording["t"][k]), recording["q"][k], recording["v"][k])
    if not moved or not isinstance(cell.sensor, DepthSensor):
        return None
    if isinstance(cell.sensor.source, DepthCamera) and "true_q" in recording:
        cell.sensor.source.joints = lambda: np.asarray(recording["true_q"][k])
    seen, image = cell.sensor.measure(cell.state), cell.sensor.reading
    return None if image is None else DepthView(
        cell.state.t, image.copy(), cell.sensor.space.pinhole.packed(), seen.points.copy(),
        seen.distance.copy(), seen.nearest.copy(), seen.active)


@compiled
def _judge_levels(A, lower, upper, offsets, x, near, fate, violation):
    """Write fate and violation of each level; a row within `near` of a side is on it."""
    for k in range(len(fate)):
        squared, acts = 0.0, False
        for i in range(offsets[k], offsets[k + 1]):
            value = 0.0
            for j in range(len(x)):
                value += A[i, j] * x[j]
            room = min(value - lower[i], upper[i] - value)
            acts |= room <= near
            if room < 0.0:
                squared += room * room
        violation[k] = sqrt(squared)
        fate[k] = 4 if violation[k] > near else 3 if acts else 2  # MISSED, MET, FREE


@compiled
def _find_saturated(x, lower, upper, near, saturated):
    """Write the side, -1 or 1, of its box at which each entry of x is; a floating base has none."""
    base = len(x) - len(lower)
    for i in range(len(lower)):
        saturated[base + i] = int(x[base + i] >= upper[i] - near) - int(
            x[base + i] <= lower[i] + near)


@compiled
def _alike(values, others, within):
    """Whether two arrays agree to `within`; infinite entries agree, NaN agrees with nothing."""
    for i in range(len(values)):
        if not (values[i] == others[i] or abs(values[i] - others[i]) <= within):
            return False
    return True
