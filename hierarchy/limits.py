"""The box of commands, never empty, from which a joint can always stop before its limits.

"Viable" is used as in A. Del Prete, "Joint Position and Velocity Bounds in Discrete-Time
Acceleration/Torque Control of Robot Manipulators", RA-L 2018; the formulas here are our own, for a
joint that comes to rest at the end of a tick, so that both levels share them. One joint, period
T [s], acceleration limit A [rad/s^2]:

    S(w) = T (w + (w - A T) + (w - 2 A T) + ...), terms > 0     distance that a joint of speed w
                                                                travels if it loses A T per tick
    F(s) = the w with S(w) = s, F(-s) = -F(s)                   S and F are piecewise linear

A velocity x moves a joint from q to q + S(x) before it rests. At acceleration level the velocity
changes linearly from v to w, and the joint rests at q + v T / 2 + S(w). So with

    r = q  (velocity level),   r = q + v T / 2  (acceleration level)                            (a)

the next velocity must lie in

    F(L - r) <= w <= F(U - r),   -V <= w <= V,   v - A T <= w <= v + A T                        (b)

and a = (w - v) / T. If F(U - r) >= 0, the joint does not exceed U between samples either: where
v > 0 > w it reverses before it would have come to rest.

What the box guarantees, for each joint by itself, with any command of the box in every tick, to
rounding:

- A state is viable if it is within `lower`, `upper` and `velocity` and can come to rest at the end
  of a tick with `acceleration` before a position limit. From a viable state no limit is exceeded,
  nor between ticks, and the next state is viable. The box is the largest for which that holds.
- Acceleration level: a joint that could keep its position limit only by reversing within a tick
  passes it by less than A T^2 / 8. To keep it would take the full A at any distance from it.
- The acceleration limit holds from every initial state, always.
- Faster than `velocity`: the speed falls by A T per tick until it is within the limit, with a
  horizon H by T/H of what it is beyond it, if that is less. A slower joint never gets faster than
  `velocity`.
- Too fast to stop: the joint brakes with the full A, as far as `velocity` and the other position
  limit allow; it exceeds its limit by what v^2 / (2 A) and the ticks make unavoidable.
- Beyond a position limit: outward speed is braked in the same manner; then the joint returns at
  least as fast as a joint that accelerates and decelerates with A and comes to rest on the limit.
  It is back after finitely many ticks, never further out than one tick before, and never faster
  than `velocity`; within a distance `ROUNDING` of the limit counts as back.
"""

from dataclasses import dataclass, field
from math import sqrt
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.errors import HierarchyError, brief, check_choice, refuse
from hierarchy.gate import array_of
from hierarchy.jit import compiled, inlined
from hierarchy.problem import Array
from hierarchy.records import NotNegative, Positive, check_fields, set_frozen
from hierarchy.task import Level

ROUNDING = 1e-12  # of a position, relative to 1 + its limit: closer to a limit counts as on it
_FAR = 1e100      # [rad] stands for an infinite distance
_CLEARANCE = 1e-3  # [rad or m] at which a horizon brings joints to rest before a position limit,
#                    so that a disturbance of 0.02 rad/s does not shorten it
_LEVELS = ("velocity", "acceleration")


@dataclass(frozen=True)
class Limits:
    """Limits of n joints that get a command every `period` [s], and the box that they leave.

    `lower`, `upper` (n,) [rad or m] and `velocity` (n,) [rad/s or m/s] may be infinite,
    `acceleration` (n,) [rad/s^2 or m/s^2] may not. A `horizon` [s] of at most a period changes
    nothing. The box is finite and never empty; see the module for what it guarantees. Raises
    HierarchyError, naming joint and value, if an entry is NaN, lower > upper, a rate or the period
    is not positive, their product too small or large, or the horizon is negative.
    """

    lower: Array
    upper: Array
    velocity: Array
    acceleration: Array
    period: Annotated[Positive, "s"]
    horizon: Annotated[NotNegative, "s"] = 0.0
    packed: Array = field(init=False, repr=False, compare=False)  # (6, n), for the kernels

    def __post_init__(self) -> None:
        rows = [array_of(f"limits: {name}", getattr(self, name)).ravel()
                for name in ("lower", "upper", "velocity", "acceleration")]
        refuse(len({len(row) for row in rows}) != 1, "limits: lower, upper, velocity and "
               f"acceleration have {', '.join(str(len(row)) for row in rows)} entries")
        lower, upper, velocity, acceleration = rows
        _refuse(~((lower <= upper) & (lower < np.inf) & (upper > -np.inf)),
                "no position lies between lower and upper", lower, upper)
        _refuse(~(velocity > 0.0), "velocity must be positive", velocity)
        _refuse(~((acceleration > 0.0) & (acceleration < np.inf)),
                "acceleration must be positive and finite", acceleration)
        check_fields(self, "limits")
        step = acceleration * self.period * self.period
        _refuse(~((step >= 1.0 / _FAR) & (step <= _FAR)), "acceleration times period "
                f"{self.period:g} s squared must be from {1.0 / _FAR:g} to {_FAR:g}", acceleration)
        times = [np.full(len(lower), time) for time in (self.period, self.horizon)]
        set_frozen(self, packed=np.array([*rows, *times]))

    def box(self, q: Array, v: Array, level: Level) -> tuple[Array, Array]:
        """Return the least and greatest command (n,), (n,) at positions q and velocities v.

        Both are finite. The command is a velocity or an acceleration, depending on `level`. Raises
        HierarchyError for q and v of another size, or a v that is not finite.
        """
        check_choice("limits: level", level, _LEVELS)
        lower, upper = np.empty((2, self.packed.shape[1]))
        if not write_box(q, v, self.packed, level == "acceleration", lower, upper):
            raise HierarchyError(f"limits: q = {brief(q)} and v = {brief(v)}: expected "
                                 f"{len(lower)} finite numbers each")
        return lower, upper

    def clamp(self, q: Array, v: Array, level: Level, x: ArrayLike) -> Array:
        """Return the command x (n,) with each entry clamped to the box.

        This is the last safeguard of a control loop: the result is finite whatever x is. NaN
        becomes the command in the box that comes nearest to a standstill. Raises HierarchyError
        for q, v or x of another size.
        """
        check_choice("limits: level", level, _LEVELS)
        command = np.atleast_1d(array_of("limits: x", x))
        if command.ndim > 1 or not clamp_into_box(q, v, self.packed, level == "acceleration",
                                                  command):
            raise HierarchyError(f"limits: {len(q)} positions, {len(v)} velocities and a command "
                                 f"of shape {command.shape} for {self.packed.shape[1]} joints")
        return command


def _refuse(bad: NDArray[np.bool_], why: str, *values: Array) -> None:
    for (i,) in np.argwhere(bad)[:1]:
        raise HierarchyError(f"limits[{i}]: {why}, got "
                             + ", ".join(str(value[i]) for value in values))


@compiled
def write_box(q, v, limits, acceleration, lower, upper):
    """Write the box of n joints into lower and upper; limits as `Limits.packed`.

    Return whether q and v are of n joints, and v is finite.
    """
    if not len(q) == len(v) == len(lower) == limits.shape[1]:
        return False
    finite = True
    for i in range(len(v)):
        lower[i], upper[i] = box(q[i], v[i], limits, i, acceleration)
        finite = finite and np.isfinite(v[i])
    return finite


@compiled
def clamp_into_box(q, v, limits, acceleration, x):
    """Clamp x (n,) in place, see `Limits.clamp`, and return whether all are of n joints."""
    if not len(q) == len(v) == len(x) == limits.shape[1]:
        return False
    for i in range(len(v)):
        lower, upper = box(q[i], v[i], limits, i, acceleration)
        rest = -v[i] / limits[4, i] if acceleration else 0.0
        x[i] = clipped(rest if np.isnan(x[i]) else x[i], lower, upper)
        if not np.isfinite(x[i]):  # q or v is not finite either
            x[i] = 0.0
    return True


@inlined
def box(q, v, limits, i, acceleration):
    """Return the least and the greatest command of joint i, which has q and v."""
    L, U, V, A, T = limits[0, i], limits[1, i], limits[2, i], limits[3, i], limits[4, i]
    H = limits[5, i]
    if not H > T:
        return widest(q, v, (L, U, V, A, T), acceleration)
    # A joint beyond its speed limit returns in H, not in a tick.
    low, up = widest(q, v, (L, U, max(V, abs(v) - (abs(v) - V) * T / H), A, T), acceleration)
    c = min(_CLEARANCE, 0.25 * (U - L))
    if not acceleration:
        least, most = next_velocities(q, L + c, U - c, V, A, H)                        # (c)
        return clipped(least, low, up), clipped(most, low, up)
    least, most = approach(q, v, (L, U, V, A), c, H)
    h = 2.0 * T + time_left(U - q if v > 0.0 else q - L, abs(v), A)
    if h < H:                                                                          # (d)
        soon, late = approach(q, v, (L, U, V, A), c * (h / H) ** 2, h)
        if v > 0.0:
            most = min(most, late)
            least = min(least, most)
        elif v < 0.0:
            least = max(least, soon)
            most = max(most, least)
    return clipped(least, low, up), clipped(most, low, up)


@inlined
def approach(q, v, limits, c, h):
    """Return the least and the greatest acceleration with a horizon h and a clearance c."""
    L, U, V, A = limits
    least, most = next_velocities(q + v * h, L + c, U - c, V, A, h)
    return (least - v) / h, (most - v) / h


@inlined
def time_left(s, v, A):
    """Return the longest horizon that brings a joint of speed v to rest within s."""
    if v * v <= A * s:
        return s / max(v, 1.0 / _FAR)
    return sqrt(max(2 * s / A - v * v / (A * A), 0.0))


@inlined
def widest(q, v, limits, acceleration):
    """Return the same without a horizon."""
    L, U, V, A, T = limits
    r = q + v * T / 2 if acceleration else q                                           # (a)
    low, up = next_velocities(r, L, U, V, A, T)                                        # (b)
    if not acceleration:
        return clipped(low, v - A * T, v + A * T), clipped(up, v - A * T, v + A * T)
    return clipped((low - v) / T, -A, A), clipped((up - v) / T, -A, A)


@inlined
def next_velocities(r, L, U, V, A, T):
    """Return the least and the greatest velocity of a joint that rests before L and U from r."""
    return clipped(fastest(L - r, A, T), -V, V), clipped(fastest(U - r, A, T), -V, V)


@inlined
def fastest(s, A, T):
    """Return F(s), the velocity from which a joint that loses A T per tick rests after s."""
    distance = min(abs(s), _FAR)
    k = np.floor((sqrt(1 + 8 * distance / (A * T * T)) - 1) / 2)  # whole steps: S(k A T) <= s
    w = k * A * T + (distance - k * (k + 1) / 2 * A * T * T) / ((k + 1) * T)
    return w if s >= 0 else -w


@inlined
def clipped(x, low, up):
    """Return x clamped to low .. up."""
    return min(max(x, low), up)
