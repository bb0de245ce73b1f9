"""Writes one row per tick while the loop runs; nothing is computed from it there."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.allocation import AVOIDANCE
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import point_at
from hierarchy.problem import Array
from hierarchy.robot import Frame, Robot
from hierarchy.state import State
from scenarios.config import Scenario
from scenarios.loop.active_sets import ActiveSets
from scenarios.loop.controller import Controller
from scenarios.loop.truth import truth_of
from scenarios.recording import listed
from scenarios.recording.facts import facts_of
from scenarios.recording.recording import Event, Recording

FASTEST = 1e3  # [rad/s or m/s] of a joint; a faster motion has diverged
_TIMES = ("time_kinematics", "time_rows", "time_resolve", "time_tick")


class _Tables(NamedTuple):
    """What is written, one row per tick: numbers, choices (T, 5), times (T, 4) [s]."""

    log: Array
    choices: NDArray[np.int16]
    times: Array


class _Seen(NamedTuple):
    """What is read in each tick: the state, the distances [m]."""

    q: Array
    v: Array
    placements: Array
    distance: Array


class Recorder:
    """Memory for a whole run, filled row by row.

    `ticks` is the number of rows written so far; `facts` are those of the first controller.
    """

    def __init__(self, controller: Controller, ticks: int) -> None:
        self.ticks = 0
        cell, robot = controller.cell, controller.cell.robot
        distances = len(cell.sensor.measurement.distance) if cell.sensor else 0
        self._orders: dict[tuple[str, ...], int] = {}
        # One row: t, q, v, a, command, end effector, cone error, distances.
        self._commanded = len(controller.sent)
        # All rows are written once here: the system maps memory when it is first touched.
        width = 5 + robot.nq + 2 * robot.n + self._commanded + distances
        self._log = np.full((ticks, width), np.nan)
        self._desired = np.full((ticks if cell.position else 0, 3, 3), np.nan)
        self._answers = np.full((ticks if cell.contacts else 0, len(controller.resolution.x)),
                                np.nan)
        self._choices = np.full((ticks, 5), -1, dtype=np.int16)
        self._times, self._over = np.full((ticks, len(_TIMES)), np.nan), np.full(ticks, np.nan)
        self._given = 1 + robot.nq + robot.n  # column of a
        self._extra = {name: np.empty((ticks, *value.shape), value.dtype)
                       for name, value in cell.plant.extra.items()}
        self._weights = np.empty(ticks if controller.blend else 0)
        self._events: list[Event] = []
        self._truth, self._active = truth_of(cell, ticks), ActiveSets(ticks)
        self.facts = facts_of(cell.scenario, robot)
        self.follow(controller)

    def follow(self, controller: Controller) -> None:
        """Continue with this controller, which has the same robot, plant and measured points."""
        self._controller, self._cell = controller, controller.cell
        cell, state = controller.cell, controller.cell.state
        self._frame = cell.robot.frame(cell.robot.end_effector)
        self._distance = cell.sensor.measurement.distance if cell.sensor else np.empty(0)
        self._write_rest = bind(
            _write, _Tables(self._log, self._choices, self._times),
            _Seen(state.q, state.v, state.placements, self._distance),
            self._frame.joint, self._frame.offset, self._commanded,
            then=(0, (0,) * 5, (0.0,) * 6))
        self._blend, self._policy = controller.blend, controller.policy

    def write(self) -> bool:
        """Record the tick whose command was just applied; return False if its state is invalid.

        A state is invalid if it is not finite or a joint is faster than FASTEST.
        """
        controller, cell, k = self._controller, self._cell, self.ticks
        order, repulsion = controller.allocation
        index = self._orders.setdefault(order, len(self._orders))
        active = cell.sensor.measurement.active + 1 if AVOIDANCE in order and cell.sensor else -1
        resolution, plant = controller.resolution, cell.plant
        finite = _write_given(self._log, k, self._given, plant.a, controller.sent)
        finite &= self._write_rest(
            k, (index, active, repulsion, resolution.status, resolution.iterations),
            (cell.state.t, controller.cone_error, *controller.stamps))
        if self._extra:
            for name, value in plant.extra.items():
                self._extra[name][k] = value
        if cell.contacts is not None and controller.answered:
            self._answers[k] = resolution.x
        if self._blend is not None:
            self._weights[k] = self._blend.weight
        if self._policy.events:
            self._events += [Event(k, *event) for event in self._policy.events]
        self.ticks = k + 1
        return bool(finite)

    def stamp(self, clock: float) -> None:
        """Note the clock [s] at the end of the tick just written."""
        self._over[self.ticks - 1] = clock

    def look(self) -> None:
        """Note of the tick just written what only a simulation knows or nobody waits for.

        That is not part of the tick's time: the desired position, true distances, and which rows
        act.
        """
        controller, cell, k = self._controller, self._cell, self.ticks - 1
        if cell.position is not None:
            cell.position.path.write(cell.state.t, self._desired[k])
        if controller.answered:
            self._active.look(k, controller.hierarchy, controller.resolution)
        if self._truth is not None:
            self._truth.look(k, cell.state.t, cell.plant.extra.get("true_q", cell.state.q))

    def finish(self, scenario: Scenario, fault: str | None) -> Recording:
        """Return the run as recorded so far."""
        robot, rows = self._cell.robot, slice(0, self.ticks)
        n, log = robot.n, self._log[rows]
        widths = [1, robot.nq, n, n, self._commanded, 3, 1, max(len(self._distance) - 1, 0)]
        ends = np.cumsum(widths)
        t, q, v, a, command, actual, cone, body = (
            log[:, end - width:end].copy() for end, width in zip(ends, widths, strict=True))
        order, active, repulsion, status, iterations = self._choices[rows].T.copy()
        signals = {"t": t[:, 0], "q": q, "v": v, "a": a, "command": command,
                   "ee_position": actual, "order": order, "status": status,
                   "iterations": iterations}
        orders = tuple(self._orders)
        if self._cell.position is not None:
            desired = self._desired[rows, 0].copy()
            signals |= {"desired_position": desired, "position_error": desired - actual}
        if self._cell.pointing is not None:
            asked = np.array(["pointing" in names for names in orders])
            signals |= {"pointing_error": cone[:, 0], "pointing_active": asked[order]}
        if self._cell.listed:
            signals |= listed.signals(robot, self._cell.listed, t[:, 0], q, v)
        if self._cell.contacts is not None:
            answers = self._answers[rows].copy()
            signals |= {"planned_acceleration": answers[:, :n],
                        "planned_force": answers[:, n:].reshape(len(answers), -1, 3)}
        if self._blend is not None:
            signals["transition"] = self._weights[rows].copy()
        signals |= {name: values[rows].copy() for name, values in self._extra.items()}
        if "true_q" in signals:
            signals["true_ee_position"] = _positions(robot, self._frame, signals["true_q"])
        if len(self._distance):
            signals |= {"control_point_distance": body, "minimal_distance": body.min(axis=1),
                        "ee_distance": log[:, -1].copy(), "active_control_point": active,
                        "repulsion_active": repulsion.astype(bool)}
        if self._truth is not None:
            signals |= self._truth.signals(self.ticks)
        signals |= self._active.signals(self.ticks)
        times = self._times[rows].copy()
        times[:, 3] = self._over[rows] - times[:, 3]
        signals |= dict(zip(_TIMES, times.T.copy(), strict=True))
        signals |= {"joint_lower": robot.lower, "joint_upper": robot.upper,
                    "velocity_limit": self._cell.velocity_limit}
        if self._cell.contacts is not None:
            signals["torque_limit"] = self._cell.torque_limit
        return Recording(signals, tuple(" > ".join(names) for names in orders), scenario,
                         self.facts, fault, tuple(self._events))


def _positions(robot: Robot, frame: Frame, q: Array) -> Array:
    """Positions (T, 3) [m] of a frame's origin at joint positions q (T, nq)."""
    state, at_rest = State(robot), np.zeros(robot.n)
    positions = np.full((len(q), 3), np.nan)
    for k, row in enumerate(q):
        if state.move(0.0, row, at_rest):
            positions[k] = state.position(frame)
    return positions


@compiled
def _write_given(log, k, first, a, command):
    """Write acceleration and command of tick k; return whether the acceleration is finite."""
    row, n, finite = log[k], len(a), True
    for j in range(n):
        row[first + j] = a[j]
        finite &= np.isfinite(a[j])
    for j in range(len(command)):
        row[first + n + j] = command[j]
    return finite


@compiled
def _write(tables, seen, joint, offset, commanded, k, chosen, measured):
    """Write the rest of tick k; return whether q is finite and v within FASTEST.

    chosen: order, active point, repulsion, status, iterations. measured: t, the error of the cone,
    and the clock at the start of the tick and after kinematics, rows and resolution.
    """
    row, finite = tables.log[k], True
    t, cone_error, begin, moved, written, resolved = measured
    row[0] = t
    i = 1
    for j in range(len(seen.q)):
        row[i + j] = seen.q[j]
        finite &= np.isfinite(seen.q[j])
    i += len(seen.q)
    for j in range(len(seen.v)):
        row[i + j] = seen.v[j]
        finite &= abs(seen.v[j]) <= FASTEST
    i += 2 * len(seen.v) + commanded
    for j in range(3):
        row[i + j] = point_at(seen.placements, joint, offset, j)
    row[i + 3] = cone_error
    i += 4
    for j in range(len(seen.distance)):
        row[i + j] = seen.distance[j]
    for j in range(len(chosen)):
        tables.choices[k, j] = min(chosen[j], 32767)
    times = tables.times[k]
    times[0], times[1], times[2] = moved - begin, written - moved, resolved - written
    times[3] = begin
    return finite
