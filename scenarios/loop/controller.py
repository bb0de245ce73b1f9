"""One tick of control: from a measured joint state to a command."""

from collections.abc import Callable
from math import inf, nan
from time import perf_counter
from typing import Any

import numpy as np

from hierarchy.allocation import Allocation
from hierarchy.jit import bind
from hierarchy.problem import Array, Hierarchy
from scenarios.cell.build import Cell
from scenarios.loop.policy import policy_of, smallest
from scenarios.loop.transition import Blend
from solvers import Resolution, Status

_REHEARSALS = 20
_ROUNDING = 1e-9  # [s] of times that are compared
_SOLVED = Status.SOLVED  # a member found by name costs 0.1 us


class Controller:
    """Senses, allocates, stacks and solves; then the policy decides what is sent.

    After `command`: `sent`; the tick's `allocation`, `cone_error`, `hierarchy` (valid until the
    next command) and `resolution`; and `stamps`, the clock [s] at the start of the tick, after
    kinematics, after rows (including sensing and allocation) and after solving, without the time
    that a simulated camera takes to render its image. A tick with an unusable measurement is not
    `answered` and leaves allocation and hierarchy unchanged. `policy` has the events of the tick,
    `blend` the weight of the present stack, or is None.
    """

    hierarchy: Hierarchy

    def __init__(self, cell: Cell, clock: Callable[[], float] | None = None) -> None:
        self.cell, self.resolver, self.clock = cell, cell.resolver, clock or perf_counter
        control = cell.scenario.control
        self.level, self.policy = control.level, policy_of(cell, control)
        self.blend = Blend(control.transition_time) if control.transition == "blend" else None
        self.cone_error = nan
        pointing = cell.tasks.pointing
        self._measure_cone = pointing.follow_cone_error(cell.state) if pointing else None
        if cell.sensor is not None:
            self._nearest = bind(smallest, cell.sensor.measurement.distance)
        self.allocation = Allocation((), repulsion=False)
        unknowns = cell.robot.n if cell.contacts is None else cell.contacts.unknowns
        self.resolution = self._unanswered = Resolution(np.zeros(unknowns),
                                                        Status.NUMERICAL_FAILURE, 0)
        self._memory: Any = None
        self._outside = 0.0
        self._deadline = control.policy.deadline or inf
        self._stale_after, self._measured_at = control.policy.stale_after, -inf
        self.sent = cell.plant.v.copy() if self.level == "velocity" else np.zeros(
            cell.robot.n - (0 if cell.contacts is None else cell.robot.actuated))
        if cell.sensor is not None:
            cell.state.measurement = cell.sensor.measurement
        for order in cell.orders:
            cell.stack.prepare(cell.state, order)

    @property
    def answered(self) -> bool:
        """Whether the resolver was called in the last tick."""
        return self.resolution is not self._unanswered

    @property
    def planned(self) -> bool:
        """Whether the tick has an x, also an inaccurate one: contact forces to count on."""
        return self.resolution.status is not Status.NUMERICAL_FAILURE

    @property
    def meant(self) -> Array:
        """What the command stands for in the rows: itself, or at level "torque" the answer."""
        return self.sent if self.cell.contacts is None else self.resolution.x

    def command(self, t: float, q: Array, v: Array, measured_at: float | None = None) -> Array:
        """Return the command to send at time t [s] with the joints at q, v.

        That is a velocity or acceleration (n,), or the torques of the actuated joints [N m].
        `measured_at` [s] is the time of q and v, None for t. The command is finite whatever was
        measured; `control.policy` decides it in a tick with trouble.
        """
        clock, state, cell_contacts = self.clock, self.cell.state, self.cell.contacts
        troubles: list[str] = []
        begin = clock()
        if measured_at is not None or not state.move(t, q, v):
            self._move(t, q, v, measured_at, troubles)
        moved = clock()
        self._sense(troubles)
        if self._outside > 0.0:
            begin, moved = begin + self._outside, moved + self._outside
        x, forces = self._answer(troubles), None
        if cell_contacts is not None:
            x, forces = cell_contacts.torques(state, x), x[state.n:]
        resolved = clock()
        self.stamps = (begin, moved, self._written, resolved)
        if resolved - begin > self._deadline:
            troubles.append("overrun")
        self.sent = sent = self.policy.choose(t, troubles, x, state.v, forces)
        if self.level != "acceleration":
            state.commanded = sent
        if cell_contacts is not None and self.planned:
            state.carried = cell_contacts.carried(t, self.resolution.x, state.carried)
        return sent

    def follow(self, before: "Controller") -> None:
        """Continue after another controller of the same robot and plant with other settings."""
        self.policy.follow(before.policy)
        if self.cell.scenario.make_resolver() == before.cell.scenario.make_resolver():
            self._memory = before._memory
        if self.blend and before.blend:
            self.blend.visits = before.blend.visits

    def rehearse(self) -> None:
        """Call every kernel of the loop once, so that none is loaded during timed ticks.

        This changes the controller's state; use another controller for the run.
        """
        plant, tasks = self.cell.plant, self.cell.stack.names
        self.command(0.0, plant.q, plant.v)
        for _ in range(_REHEARSALS):
            self.resolver.solve(self.cell.stack.hierarchy(self.cell.state, tasks), self._memory)
        plant.act(np.zeros_like(self.sent))

    def _move(self, t: float, q: Array, v: Array, measured_at: float | None,
              troubles: list[str]) -> None:
        """Move to a new, finite measurement; otherwise extrapolate from the last one."""
        state, stamp = self.cell.state, t if measured_at is None else measured_at
        new = stamp > self._measured_at
        if new and state.move(t, q, v):
            self._measured_at = stamp
            return
        if new:
            troubles.append("not_finite")
        elif t - stamp > self._stale_after + _ROUNDING:
            troubles.append("stale")
        dt, x = t - state.t, self.sent  # on under the last command
        if self.level == "torque":
            slowing = self.policy.slowing
            x = -slowing * state.v if slowing else self.resolution.x[:state.n]
        moved, after = (x * dt, x) if self.level == "velocity" else (
            state.v * dt + x * (dt * dt / 2), state.v + x * dt)
        state.move(t, state.robot.integrate(state.q, moved), after)

    def _sense(self, troubles: list[str]) -> None:
        cell = self.cell
        if self._measure_cone is not None:
            self.cone_error = self._measure_cone()
        if cell.sensor is not None:
            cell.sensor.measure(cell.state)
            self._outside = cell.sensor.outside
            if cell.sensor.measurement.blind and "stale" not in troubles:
                troubles.append("stale")
            nearest = self._nearest()
            if not nearest > 0.0:
                troubles.append("inside" if nearest <= 0.0 else "not_finite")

    def _answer(self, troubles: list[str]) -> Array:
        """Return the resolver's answer, or zero if the measurement is unusable."""
        if troubles and troubles != ["inside"]:
            self.resolution, self._written = self._unanswered, self.clock()
            return self.resolution.x
        cell = self.cell
        seen = None if cell.sensor is None else cell.sensor.measurement
        self.allocation = allocation = cell.order(seen, self.cone_error)
        order = allocation.order
        self.hierarchy = hierarchy = cell.stack.hierarchy(cell.state, order)
        self._written = self.clock()
        if self.blend is None:
            self.resolution = resolution = self.resolver.solve(hierarchy, self._memory)
            x, self._memory = resolution.x, resolution.memory
        else:
            resolution, x = self.blend.resolve(self.resolver, cell.stack, cell.state, order,
                                               hierarchy)
            self.resolution = resolution
        if resolution.status is not _SOLVED:
            troubles.append(resolution.status.name.lower())
        return x
