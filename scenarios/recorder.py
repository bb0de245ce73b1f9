"""Writes one row a tick while the loop runs; nothing is computed from it there."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

import numpy as np

from hierarchy.compiled import compiled
from hierarchy.kinematics import point_at
from scenarios.build import Cell
from scenarios.config import Scenario
from scenarios.recording import Recording

_TIMES = ("time_kinematics", "time_rows", "time_resolve", "time_tick")


class Recorder:
    """Room for a whole run, filled row by row.

    `ticks` is the number of rows written so far.
    """

    def __init__(self, cell: Cell, ticks: int) -> None:
        self.ticks = 0
        self._cell = cell
        robot = cell.robot
        self._frame = robot.frame(robot.end_effector)
        self._points = len(cell.sensor.measurement.distance) if cell.sensor else 0
        self._distance = (cell.sensor.measurement.distance if cell.sensor
                          else np.empty(0))
        self._target = cell.position.target if cell.position else np.full((3, 3), np.nan)
        self._orders: dict[tuple[str, ...], int] = {}
        # One row: t, q, v, a, command, end effector, target, cone error, distances.
        self._log = np.empty((ticks, 1 + robot.nq + 3 * robot.n + 7 + self._points))
        self._choices = np.empty((ticks, 5), dtype=np.int16)
        self._times = np.empty((ticks, len(_TIMES)))

    def write(self, command, cone_error: float, order: tuple[str, ...], active: int,
              repulsion: bool, status: int, iterations: int, times: tuple[float, ...]) -> bool:
        """Record one tick after its command was applied; False if the state is not finite."""
        index = self._orders.get(order)
        if index is None:
            index = self._orders[order] = len(self._orders)
        k, state = self.ticks, self._cell.state
        finite = _write(self._log, self._choices, self._times, k, state.t, state.q, state.v,
                        self._cell.plant.a, command, state.placements, self._frame.joint,
                        self._frame.offset, self._target, cone_error, self._distance,
                        index, active, repulsion, status, iterations, *times)
        self.ticks = k + 1
        return bool(finite)

    def finish(self, scenario: Scenario, fault: str | None) -> Recording:
        """Return what was recorded so far."""
        robot, rows = self._cell.robot, slice(0, self.ticks)
        n, log = robot.n, self._log[rows]
        widths = [1, robot.nq, n, n, n, 3, 3, 1, max(self._points - 1, 0)]
        ends = np.cumsum(widths)
        t, q, v, a, command, actual, desired, cone, body = (
            log[:, end - width:end].copy() for end, width in zip(ends, widths, strict=True))
        order, active, repulsion, status, iterations = self._choices[rows].T.copy()
        signals = {"t": t[:, 0], "q": q, "v": v, "a": a, "command": command,
                   "ee_position": actual, "order": order, "status": status,
                   "iterations": iterations}
        orders = tuple(self._orders)
        if self._cell.position is not None:
            signals |= {"desired_position": desired, "position_error": desired - actual}
        if self._cell.pointing is not None:
            asked = np.array(["pointing" in names for names in orders])
            signals |= {"pointing_error": cone[:, 0], "pointing_active": asked[order]}
        if self._points:
            signals |= {"control_point_distance": body, "minimal_distance": body.min(axis=1),
                        "ee_distance": log[:, -1].copy(), "active_control_point": active,
                        "repulsion_active": repulsion.astype(bool)}
        signals |= dict(zip(_TIMES, self._times[rows].T.copy(), strict=True))
        signals |= {"joint_lower": robot.lower, "joint_upper": robot.upper,
                    "velocity_limit": robot.velocity_limit}
        return Recording(signals, tuple(" > ".join(names) for names in orders), scenario, fault)


@compiled
def _write(log, choices, times, k, t, q, v, a, command, placements, joint, offset, target,
           cone_error, distance, order, active, repulsion, status, iterations,
           kinematics, rows, resolve, tick):
    row = log[k]
    row[0] = t
    i = 1
    finite = True
    for j in range(len(q)):
        row[i + j] = q[j]
        finite &= np.isfinite(q[j])
    i += len(q)
    for j in range(len(v)):
        row[i + j] = v[j]
        finite &= np.isfinite(v[j])
    i += len(v)
    for j in range(len(v)):
        row[i + j] = a[j]
        row[i + len(v) + j] = command[j]
        finite &= np.isfinite(a[j])
    i += 2 * len(v)
    for j in range(3):
        row[i + j] = point_at(placements, joint, offset, j)
        row[i + 3 + j] = target[0, j]
    row[i + 6] = cone_error
    i += 7
    for j in range(len(distance)):
        row[i + j] = distance[j]
    choices[k, 0] = order
    choices[k, 1] = active
    choices[k, 2] = repulsion
    choices[k, 3] = status
    choices[k, 4] = min(iterations, 32767)
    times[k, 0] = kinematics
    times[k, 1] = rows
    times[k, 2] = resolve
    times[k, 3] = tick
    return finite
