"""Limits of joint positions, velocities and accelerations, with a row for every joint."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, brief, finite_numbers, naming, positive
from hierarchy.gate import array_of
from hierarchy.jit import bind
from hierarchy.kinematics import write_identity
from hierarchy.limits import Limits, write_box
from hierarchy.problem import Array
from hierarchy.records import NotNegative, set_frozen
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, Rows, Writer, Written


class JointRows(Written):
    """A task with one row per actuated joint of `robot`, or per velocity from `first` on."""

    robot: Robot
    straight = True

    @property
    def first(self) -> int:
        """The velocity of the first row: the first that is actuated."""
        return self.robot.actuated

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joint of each row."""
        return tuple(self.robot.velocity_names[self.first:])


@dataclass(frozen=True)
class JointLimits(JointRows):
    """Keep every joint within its limits and able to stop before them: lower <= x <= upper.

    One row of the identity per actuated joint, at both levels: n rows, or n - 6 with a floating
    base; below, n stands for that number. Positions and velocities are limited by the limits of
    `robot`, `margin` [rad or m] is kept from each position limit, `acceleration` [rad/s^2 or m/s^2]
    is one number or (n,), `period` [s] is that of the control loop. For what is guaranteed from
    which initial state, and for `horizon` [s], see `hierarchy.limits`. A continuous joint has no
    position limits. At velocity level the acceleration is that of the commands.

    With `base_speed` or `base_acceleration`, (linear, angular) in [m, rad, s], a floating base has
    rows too, the first six. What is not given is then the speed limit of the robot, or the largest
    `acceleration`. Leave them out for a base that only contact forces move.

    Raises HierarchyError for an invalid limit, no room, or a fixed base with a speed.
    """

    robot: Robot
    acceleration: float | ArrayLike
    period: float
    margin: NotNegative = 0.0
    name: str = "joint limits"
    base_speed: tuple[float, float] | None = None
    base_acceleration: tuple[float, float] | None = None
    horizon: float = 0.0
    limits: Limits = field(init=False, repr=False, compare=False)
    kind = "inequality"

    def __post_init__(self) -> None:
        super().__post_init__()
        robot = self.robot
        acceleration = array_of(f"task {self.name!r}: acceleration", self.acceleration)
        n = robot.n - robot.actuated
        self.refuse(acceleration.shape not in ((), (n,)), "acceleration has shape "
                    f"{acceleration.shape}, expected a number or ({n},)")
        lower, upper = robot.position_limits()
        for i in np.flatnonzero(upper - lower < 2.0 * self.margin)[:1]:
            raise HierarchyError(f"task {self.name!r}: margin {self.margin:g} leaves "
                                 f"{robot.velocity_names[i]} no room between {lower[i]:.4g} and "
                                 f"{upper[i]:.4g}")
        speed = robot.velocity_limit.copy()
        rate = np.append(np.full(robot.actuated, acceleration.max(initial=-np.inf)),
                         np.broadcast_to(acceleration, n))
        for what, limit in (("base_speed", speed), ("base_acceleration", rate)):
            if (given := getattr(self, what)) is not None:
                self.refuse(robot.base == "fixed", f"robot {robot.name!r} has a fixed base, which "
                            "has no speed to limit")
                limit[:6] = np.repeat(finite_numbers(f"task {self.name!r}: {what}", given, 2), 3)
        # Coupled joints stop together: as the slowest of them. Each pass reaches one joint further.
        for one in robot.coupled * (1 + len(robot.coupled)):
            if one.other and len(one.coefficients) == 2 and (slope := abs(one.coefficients[1])):
                led, leader = map(robot.velocity_names.index, (one.joint, one.other))
                rate[leader] = min(rate[leader], rate[led] / slope)
                rate[led] = min(rate[led], slope * rate[leader])
        of = slice(self.first, robot.n)
        with naming(f"task {self.name!r}"):
            set_frozen(self, limits=Limits(lower[of] + self.margin, upper[of] - self.margin,
                                           speed[of], rate[of], self.period, self.horizon))

    @property
    def first(self) -> int:
        """The velocity of the first row: 0, or that of the first joint behind a floating base."""
        of_joints = self.base_speed is None and self.base_acceleration is None
        return self.robot.actuated if of_joints else 0

    def box(self, state: State, level: Level) -> tuple[Array, Array]:
        """Return the least and greatest command (n,), (n,) at a state; the box is never empty."""
        return self.rows(state, level)[1:]

    def clamp(self, state: State, level: Level, x: ArrayLike) -> Array:
        """Return the command x, including the base, clamped to the box; finite even if x is not.

        NaN becomes the command in the box that comes nearest to a standstill; zero for a base
        without limits.
        """
        first, positions, rates = self.first, self._positions(state), self._rates(state, level)
        if first == 0:
            return self.limits.clamp(positions, rates, level, x)
        command = np.atleast_1d(array_of(f"task {self.name!r}: x", x))
        command[:first][~np.isfinite(command[:first])] = 0.0
        command[first:] = self.limits.clamp(positions, rates, level, command[first:])
        return command

    def error(self, state: State) -> Array:
        """Distance of each joint from its range (n,) [rad or m], zero inside it."""
        q = self._positions(state)
        return np.abs(np.clip(q, *self.limits.packed[:2]) - q)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`; the rows have two sides."""
        write_rows, acceleration = bind(write_identity, rows.A), level == "acceleration"

        def write() -> None:
            write_rows()
            rates = self._rates(state, level)
            if not isinstance(rates, np.ndarray) or not write_box(
                    self._positions(state), rates, self.limits.packed, acceleration, *rows[1:]):
                raise HierarchyError(f"task {self.name!r}: state.commanded = "
                                     f"{brief(state.commanded)}: expected {state.n} finite numbers")

        return write

    def _positions(self, state: State) -> Array:
        robot = self.robot
        q: Array = state.q
        return q if robot.nq == robot.n else q[robot.coordinates[self.first:]]

    def _rates(self, state: State, level: Level) -> Array:
        """The velocities (n,) that limit the next ones."""
        commanded = state.commanded if level == "velocity" else None
        rates: Array = state.v if commanded is None else commanded
        return rates[self.first:] if self.first else rates


APPROACH = 0.25  # gain times period: a robot that lags a tick comes to rest without overshooting


@dataclass(frozen=True)
class StepLimits(JointRows):
    """Keep each joint within its limits of position and speed: gain (lower - q) <= v, and so on.

    One row per velocity, n in number, with infinite sides where the robot has no limit. A joint
    comes nearer to a limit by the share gain times `period` [s] of its distance per tick. `gain`
    [1/s] is at most 1 / period, and None for a quarter of it: a robot that obeys one tick late then
    comes to rest at its limit, beyond a quarter it oscillates. Beyond a limit a joint comes back in
    the same way, as fast as its velocity limit allows. Accelerations are not limited, so that a
    step does not depend on the one before; see `hierarchy.tasks.JointLimits`.

    Raises HierarchyError for a period or gain out of range, and at another level than velocity.
    """

    robot: Robot
    period: float
    gain: float | None = None  # type: ignore[assignment]
    name: str = "limits"
    kind = "inequality"
    first = 0

    def __post_init__(self) -> None:
        positive(f"task {self.name!r}: period [s]", self.period)
        gain = APPROACH / self.period if self.gain is None else self.gain
        positive(f"task {self.name!r}: gain [1/s]", gain, 1.0 / self.period)
        set_frozen(self, gain=gain)
        super().__post_init__()
        fastest = self.robot.velocity_limit
        for (i,) in np.argwhere(~(fastest >= 0.0))[:1]:
            self.refuse(True, f"velocity_limit[{i}] is {fastest[i]:g}, expected a number >= 0")

    def box(self, state: State) -> tuple[Array, Array]:
        """Least and largest velocity of each joint (n,), (n,) [rad/s or m/s]."""
        q, fastest = state.q[self.robot.coordinates], self.robot.velocity_limit
        lower, upper = (np.minimum(np.maximum(self.gain * (side - q), -fastest), fastest)
                        for side in self.robot.position_limits())
        return lower, upper

    def error(self, state: State) -> Array:
        """How far each velocity would have to be from zero (n,) [rad/s or m/s]."""
        lower, upper = self.box(state)
        return np.maximum(np.maximum(lower, -upper), 0.0)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`; for velocity level."""
        self.refuse(level != "velocity", "for velocity level; see JointLimits")
        unit = np.eye(state.n)

        def write() -> None:
            rows.A[:] = unit
            rows.lower[:], rows.upper[:] = self.box(state)

        return write
