"""Writes one row per tick while the loop runs; nothing is computed from it there."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy import plugins
from hierarchy.allocation import AVOIDANCE
from hierarchy.errors import HierarchyError, UnknownNameError, naming, refuse
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import place
from hierarchy.problem import Array
from scenarios.config import Scenario
from scenarios.loop.audit import ActiveSets, Audit, Truth
from scenarios.loop.controller import Controller
from scenarios.recording import listed
from scenarios.recording.facts import facts_of, placed_points
from scenarios.recording.recording import Event, Recording
from scenarios.recording.signals import check_shapes, known

FASTEST = 1e3  # [rad/s or m/s] of a joint; a faster motion has diverged
_CHOICES = ("order", "active_control_point", "repulsion_active", "status", "iterations")
_TIMES = ("time_kinematics", "time_rows", "time_resolve", "time_tick")


class _Log(NamedTuple):
    """What is written in each tick; names are those of signals.

    choices, times : see _CHOICES, _TIMES; the last of the times is first the clock at the start of
    the tick.
    """

    t: Array
    q: Array
    v: Array
    a: Array
    command: Array
    ee_position: Array
    pointing_error: Array
    distance: Array
    choices: NDArray[np.int16]
    times: Array


class _Seen(NamedTuple):
    """What the recorder reads in each tick: the state, the distances [m]."""

    q: Array
    v: Array
    placements: Array
    distance: Array


class Recorder:
    """Memory for a whole run, filled row by row.

    `ticks` is the number of rows that are complete, which `look` makes them: a tick that was broken
    off is not part of the run. `facts` are those of the first controller.
    `audits` examine every tick that the controller has answered; in others their signals are NaN,
    -1 if they are integers, or false.
    """

    def __init__(self, controller: Controller, ticks: int, audits: Sequence[Audit] = ()) -> None:
        self.ticks = 0
        cell, robot = controller.cell, controller.cell.robot
        points = len(cell.sensor.measurement.distance) if cell.sensor else 0
        self._orders: dict[tuple[str, ...], int] = {}

        def rows(*shape: int, count: int = ticks) -> Array:
            """Return rows of NaN: the system maps memory when it is first touched."""
            return np.full((count, *shape), np.nan)

        self._log = _Log(rows(), rows(robot.nq), rows(robot.n), rows(robot.n),
                         rows(len(controller.sent)), rows(3), rows(), rows(points),
                         np.full((ticks, len(_CHOICES)), -1, dtype=np.int16), rows(len(_TIMES)))
        self._a, self._command = self._log.a, self._log.command
        self._desired = rows(3, 3, count=ticks if cell.tasks.position else 0)
        self._answers = rows(len(controller.resolution.x), count=ticks if cell.contacts else 0)
        self._plant = f"plant of kind {cell.scenario.plant.kind!r}"
        self._extra = {name: np.empty((ticks, *np.shape(value)), np.asarray(value).dtype)
                       for name, value in cell.plant.extra.items()}
        self._weights = np.empty(ticks if controller.blend else 0)
        self._events: list[Event] = []
        self._always: tuple[Audit, ...] = (Truth(cell),)
        self._audits: tuple[Audit, ...] = (*self._always, ActiveSets(), *audits)
        self._audited: dict[str, NDArray[Any]] = {}
        self.facts = facts_of(cell.scenario, robot, cell.contacts)
        self.follow(controller)
        none = slice(0)
        self._own = {*self._of_controller(_Log._make([of[none] for of in self._log]), none)}
        self._check(f"{self._plant}: extra", self._extra)

    def follow(self, controller: Controller) -> None:
        """Continue with this controller, which has the same robot, plant and measured points."""
        self._controller, self._cell = controller, controller.cell
        cell, state = controller.cell, controller.cell.state
        self._frame = cell.robot.frame(cell.robot.end_effector)
        distance = cell.sensor.measurement.distance if cell.sensor else np.empty(0)
        self._write_rest = bind(_write, self._log,
                                _Seen(state.q, state.v, state.placements, distance),
                                self._frame.joint, self._frame.offset,
                                then=(0, (0,) * len(_CHOICES), (0.0,) * 6))
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
        self._command[k] = controller.sent
        try:
            self._a[k] = plant.a
            if self._extra:
                for name, values in self._extra.items():
                    values[k] = plant.extra[name]
        except (AttributeError, KeyError, TypeError, ValueError) as error:  # a user's code
            raise HierarchyError(f"{self._plant}: a or extra has changed: {error}") from error
        finite = self._write_rest(
            k, (index, active, repulsion, resolution.status, resolution.iterations),
            (cell.state.t, controller.cone_error, *controller.stamps))
        if cell.contacts is not None and controller.planned:
            self._answers[k] = resolution.x
        if self._blend is not None:
            self._weights[k] = self._blend.weight
        if self._policy.events:
            self._events += [Event(k, *event) for event in self._policy.events]
        return bool(finite)

    def stamp(self, clock: float) -> None:
        """Note the clock [s] at the end of the tick just written."""
        times = self._log.times[self.ticks]
        times[3] = clock - times[3]

    def look(self) -> None:
        """Note the desired position, true distances and audits of the tick just written.

        That is not part of the tick's time: a controller does not wait for it.
        """
        controller, cell, k = self._controller, self._cell, self.ticks
        if cell.tasks.position is not None:
            cell.tasks.position.path.write(cell.state.t, self._desired[k])
        for audit in self._audits if controller.answered else self._always:
            for name, given in audit(k, controller).items():
                if name not in self._audited:
                    first = np.asarray(given)
                    nothing = {"f": np.nan, "i": -1}.get(first.dtype.kind, 0)
                    rows = np.full((len(self._log.t), *first.shape), nothing, first.dtype)
                    self._check("an audit", {name: rows})
                    self._audited[name] = rows
                self._audited[name][k] = given
        self.ticks = k + 1

    def _check(self, what: str, signals: Mapping[str, NDArray[Any]]) -> None:
        """Raise a HierarchyError for a further signal that is unknown, recorded or misshapen."""
        robot = self._cell.robot
        with naming(what):
            for name in signals:
                refuse(name in self._own, f"{name!r}, which the loop records")
                if known(name) is None:
                    raise UnknownNameError("signal", name, plugins.known("signals"))
            check_shapes(signals, T=len(self._log.t), nq=robot.nq, n=robot.n)

    def finish(self, scenario: Scenario, fault: str | None) -> Recording:
        """Return the run as recorded so far."""
        recording = replace(self.part(slice(self.ticks), scenario), fault=fault,
                            events=tuple(one for one in self._events if one.tick < self.ticks))
        recording.signals.update((name, rows[:self.ticks].copy())
                                 for name, rows in self._audited.items())
        return recording

    def part(self, rows: slice | NDArray[np.int64], scenario: Scenario) -> Recording:
        """Return some ticks of the run, without their events and what audits say of them."""
        log = _Log._make([values[rows].copy() for values in self._log])
        signals = self._of_controller(log, rows) | {
            name: values[rows].copy() for name, values in self._extra.items()}
        robot, cell = self._cell.robot, self._cell
        if "true_q" in signals:
            placed = self.facts.robot.placements(signals["true_q"])
            signals["true_ee_position"] = placed_points(
                placed, [self._frame.joint], self._frame.offset)[:, 0]
            at = signals["t"], signals["true_q"], signals.get("true_v", signals["v"])
            signals |= {f"true_{name}": values for name, values in listed.signals(
                robot, cell.tasks.listed, *at).items()}
            if (task := cell.tasks.pointing) is not None:
                (error,) = listed.signals(robot, [task], *at).values()
                signals["true_pointing_error"] = error[:, 0]
        signals |= {"joint_lower": robot.lower, "joint_upper": robot.upper,
                    "velocity_limit": cell.velocity_limit}
        if cell.contacts is not None:
            signals["torque_limit"] = cell.torque_limit
        return Recording(signals, tuple(map(" > ".join, self._orders)), scenario, self.facts)

    def _of_controller(self, log: _Log, rows: slice | NDArray[np.int64]
                       ) -> dict[str, NDArray[Any]]:
        """Return the signals of what the controller knew and did."""
        cell, n = self._cell, self._cell.robot.n
        order, active, repulsion, status, iterations = log.choices.T.copy()
        signals = {"t": log.t, "q": log.q, "v": log.v, "a": log.a,
                   "command": log.command, "ee_position": log.ee_position,
                   "order": order, "status": status, "iterations": iterations,
                   **dict(zip(_TIMES, log.times.T.copy(), strict=True))}
        if cell.tasks.position is not None:
            desired = self._desired[rows, 0].copy()
            signals |= {"desired_position": desired,
                        "position_error": desired - log.ee_position}
        if cell.tasks.pointing is not None:
            asked = np.array(["pointing" in names for names in self._orders])
            signals |= {"pointing_error": log.pointing_error, "pointing_active": asked[order]}
        if cell.tasks.listed:
            signals |= listed.signals(cell.robot, cell.tasks.listed, log.t, log.q, log.v)
        if cell.contacts is not None:
            answers, points = self._answers[rows].copy(), len(cell.contacts.points.joints)
            signals |= {"planned_acceleration": answers[:, :n],
                        "planned_force": answers[:, n:].reshape(len(answers), points, 3)}
        if self._blend is not None:
            signals["transition"] = self._weights[rows].copy()
        if log.distance.shape[1]:
            body = log.distance[:, :-1].copy()
            signals |= {"control_point_distance": body, "minimal_distance": body.min(axis=1),
                        "ee_distance": log.distance[:, -1].copy(), "active_control_point": active,
                        "repulsion_active": repulsion.astype(bool)}
        return signals


@compiled
def _write(log, seen, joint, offset, k, chosen, measured):
    """Write the rest of tick k; return whether q and a are finite and v within FASTEST.

    chosen: see _CHOICES. measured: t, the error of the cone, and the clock at the start of the tick
    and after kinematics, rows and resolution.
    """
    finite = True
    log.t[k], log.pointing_error[k], begin, moved, written, resolved = measured
    for j in range(len(seen.q)):
        log.q[k, j] = seen.q[j]
        finite &= np.isfinite(seen.q[j])
    for j in range(len(seen.v)):
        log.v[k, j] = seen.v[j]
        finite &= abs(seen.v[j]) <= FASTEST and np.isfinite(log.a[k, j])
    at = place(seen.placements[joint], offset)
    log.ee_position[k, 0], log.ee_position[k, 1], log.ee_position[k, 2] = at
    for j in range(len(seen.distance)):
        log.distance[k, j] = seen.distance[j]
    for j in range(len(chosen)):
        log.choices[k, j] = min(chosen[j], 32767)
    times = log.times[k]
    times[0], times[1], times[2] = moved - begin, written - moved, resolved - written
    times[3] = begin
    return finite
