"""What is sent in a tick with trouble, and the guard that every command passes through."""

from collections.abc import Callable, Sequence
from functools import partial
from math import inf
from typing import final

import numpy as np

from hierarchy.contacts import Contacts
from hierarchy.jit import compiled
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Rows
from hierarchy.tasks import BaseDynamics
from scenarios.cell.build import Cell
from scenarios.config.sections.control import ControlSection

_ORDER = ("use", "hold", "brake", "stop")  # the last of those requested in a tick is taken
_BRAKE = 10.0    # [1/s] deceleration per velocity
_AT_REST = 1e-9  # [rad/s]
_UNCHANGED = 1e-9  # change by a clamp that is not reported, relative to 1 + |x|


@final
class Policy:
    """Chooses the command of each tick.

    `clamp` moves a command (n,) to the nearest one that the robot's limits allow in this tick; None
    for a robot without limits. `again` does so in a tick with trouble, by default `clamp`. At level
    "torque" `torques` returns those, within their limits, of accelerations (n,) and contact
    forces, None for none. After `choose`: `events` are the (kind, action) pairs of the tick;
    `slowing` [1/s] is the deceleration per velocity where it brakes, else 0; `fault` is the reason
    for ending the run, once a "stop" was requested, and `stopped` is whether the robot has come to
    rest since then, or at level "torque" is to be left to itself.
    """

    def __init__(self, control: ControlSection, clamp: Callable[[Array], Array] | None = None,
                 torques: Callable[[Array, Array | None], Array] | None = None,
                 again: Callable[[Array], Array] | None = None) -> None:
        self.events: Sequence[tuple[str, str]] = ()
        self.fault: str | None = None
        self.stopped, self.slowing, self._held = False, 0.0, 0
        self._section, self._clamp, self._period = control.policy, clamp, control.period
        self._again = again or clamp
        self._acceleration, self._torques = control.level == "acceleration", torques
        self._good: Array | None = None
        self._forces: Array | None = None

    def follow(self, before: "Policy") -> None:
        """Continue after another policy of the same robot: its stop, and its last good command."""
        self.fault, self._good = before.fault, before._good
        self._held, self._forces = before._held, before._forces

    def choose(self, t: float, troubles: Sequence[str], x: Array, v: Array,
               forces: Array | None = None) -> Array:
        """Return the command (n,) to send at time t [s].

        `troubles` are the kinds of trouble of the tick, x (n,) the answer, v (n,) the joint
        velocity as far as known, `forces` those planned with x. The command is finite and within
        the limits.
        """
        self.slowing = 0.0
        if troubles or self.fault is not None or not finite(x):
            return self._otherwise(t, troubles, x, v)
        self.events, self._held, self._forces = (), 0, forces
        self._good = command = x if self._clamp is None else self._within(self._clamp, x)
        return command

    def _otherwise(self, t: float, troubles: Sequence[str], x: Array, v: Array) -> Array:
        if not finite(x):  # no resolver should
            troubles, x = [*troubles, "numerical_failure"], np.zeros_like(x)
        action = "stop" if self.fault is not None else max(
            (getattr(self._section, kind) for kind in troubles), key=_ORDER.index)
        held = self._good if self._held < self._section.patience else None
        if action == "hold" and held is None:
            action = "brake"
        self.events = [(kind, action) for kind in troubles]
        if action == "use":
            return self._within(self._again, x)
        if action == "hold" and held is not None:
            self._held += 1
            return self._within(self._again, held)
        if action == "stop" and self.fault is None:
            self.fault = f"stopped by its policy at t = {t:.3f} s: {', '.join(troubles)}"
        return self._slower(action, v)

    def _slower(self, action: str, v: Array) -> Array:
        """Return the command that brings v toward zero: at once for "stop", else at `_BRAKE`.

        At level "torque" that is under the last good contact forces, and "stop" ends the run.
        """
        rate = self.slowing = 1.0 / self._period
        if action == "brake" or self._torques is not None:
            rate = self.slowing = min(rate, _BRAKE)
        if self._torques is not None:
            self.stopped = action == "stop"
            return self._torques(-rate * v, self._forces)
        command = -rate * v if self._acceleration else np.zeros_like(v)
        if self._clamp is not None:
            command = self._clamp(command)
        if action == "stop":
            after = v + command * self._period if self._acceleration else command
            self.stopped = bool(np.abs(after).max() <= _AT_REST)
        return command

    def _within(self, clamp: Callable[[Array], Array] | None, x: Array) -> Array:
        """Return x moved within the limits; a change is an event."""
        if clamp is None:
            return x
        command = clamp(x)
        if _differ(command, x):
            self.events = [*self.events, ("beyond_limits", "clamp")]
        return command


def policy_of(cell: Cell, control: ControlSection) -> Policy:
    """Return the policy of a cell, with the limits of its robot."""
    if cell.contacts is None:
        joints = cell.tasks.limits
        return Policy(control, partial(joints.clamp, cell.state, control.level) if joints else None)
    limits, limit = cell.scenario.limits, cell.torque_limit
    step = (limits and limits.torque_step) or inf
    soft = inf if cell.scenario.forces_in_stack else step  # a level of the stack keeps the step
    clamp = partial(_clamped, cell.state, limit, step)
    return Policy(control, partial(_clamped, cell.state, limit, soft),
                  _slowed(cell.state, cell.contacts, clamp), clamp)


def _slowed(state: State, contacts: Contacts, clamp: Callable[[Array], Array]
            ) -> Callable[[Array, Array | None], Array]:
    """Return a function for the torques of joint accelerations under contact forces, clamped.

    A floating base accelerates as the forces make it, whatever the first entries ask for.
    """
    base, n = contacts.robot.actuated, state.n
    x, rows = np.zeros(contacts.unknowns), Rows.empty(base, contacts.unknowns)
    write = BaseDynamics(contacts).writer(state, "torque", rows)

    def torques(accelerations: Array, forces: Array | None) -> Array:
        write()
        x[:n], x[n:] = accelerations, 0.0 if forces is None else forces
        x[:base] = np.linalg.solve(rows.A[:, :base], rows.lower - rows.A[:, base:] @ x[base:])
        return clamp(contacts.torques(state, x))

    return torques


def _clamped(state: State, limit: Array, step: float, torques: Array) -> Array:
    """Return torques moved within their limits, and at most `step` from those sent before."""
    low, up = -limit, limit
    if state.commanded is not None:
        low, up = (np.clip(side, state.commanded - step, state.commanded + step)
                   for side in (low, up))
    return np.clip(torques, low, up)


@compiled
def finite(values):
    """Whether all entries of an array (n,) are finite."""
    for i in range(len(values)):  # noqa: SIM110, numba has no generators here
        if not np.isfinite(values[i]):
            return False
    return True


@compiled
def _differ(command, x):
    """Whether a clamp changed x (n,) by enough to be reported."""
    most = largest = 0.0
    for i in range(len(x)):
        most, largest = max(most, abs(command[i] - x[i])), max(largest, abs(x[i]))
    return most > _UNCHANGED * (1.0 + largest)


@compiled
def smallest(values):
    """Return the smallest entry of an array (n,): NaN if any is NaN, infinity if it is empty."""
    least = np.inf
    for i in range(len(values)):
        if np.isnan(values[i]):
            return np.nan
        least = min(least, values[i])
    return least
