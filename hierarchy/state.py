"""State of a robot at one time: everything that a task may read."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from operator import attrgetter
from typing import Any, NamedTuple, TypeGuard

import numpy as np
from numba.core.errors import NumbaError
from numpy.typing import ArrayLike

from hierarchy.avoidance.measurement import Measurement
from hierarchy.errors import RobotError, brief, expect, naming, number, refuse
from hierarchy.gate import array_of
from hierarchy.jit import compiled, inlined
from hierarchy.kinematics import Kinematics
from hierarchy.notebook import numbers
from hierarchy.problem import Array
from hierarchy.robot import Frame, Robot
from hierarchy.robots.library import pin

_MISFIT = -1  # arrays of other shapes
_OFF, _EXACT = 2e-3, 1e-14  # of the squared length of a quaternion: too much, and rounding


class Dynamics(NamedTuple):
    """The equations of motion M a + h = efforts: M (n, n) [kg m^2] and h (n,) [N m or N].

    M(q) is the joint-space inertia matrix, h(q, v) the efforts of gravity, Coriolis and centrifugal
    forces.
    """

    M: Array
    h: Array


class Momentum(NamedTuple):
    """The momentum A v of the whole robot: A(q) (6, n), and its time derivative dA (6, n).

    The first three rows are linear [kg m/s], the others angular about the centre of mass
    [kg m^2/s], in world axes. Source: D. Orin, A. Goswami, S.-H. Lee, "Centroidal dynamics of a
    humanoid robot", Autonomous Robots (2013).
    """

    A: Array
    dA: Array  # noqa: N815


def _moved(name: str) -> Any:
    """Return an array that only `move` writes: kernels and pinocchio are bound to its memory."""
    def refuse_value(state: State, value: object) -> None:
        raise RobotError(f"robot {state.robot.name!r}: State.{name} cannot be set; "
                         "state.move(t, q, v) goes there")

    return property(attrgetter(f"_{name}"), refuse_value)


class State:
    """Time, joint state and kinematics of one tick: everything that a task may read.

    t [s], q (nq,), quaternions as (x, y, z, w), v (n,); J, dJ (6, n) world-frame spatial Jacobian
    of every joint and its time derivative, linear part at the world origin; placements (joints + 1,
    12): rotation (column by column) and translation of each joint's frame; supports (joints + 1, n)
    whether a column moves a body. `kinematics` has all arrays that kernels read. J, dJ and
    placements are views of the results of the last `move`.

    With `period` > 0 [s] derivatives are backward differences against previous_J and
    previous_placements, those of the previous `move`; with 0 they are exact. `measurement` is that
    of this tick, or None. `commanded` is the last command: velocities (n,), which differ from v on
    a robot that lags, or torques of the actuated joints; None before the first, and for
    accelerations. `sound` is whether the last `move` was to finite positions and velocities.
    `carried` (C,) [N] is what the contacts carried by the last answer, see `Contacts.carried`, or
    None.
    """

    q: Array = _moved("q")
    v: Array = _moved("v")

    def __init__(self, robot: Robot, differences: float | None = None) -> None:
        expect("State: robot", robot, Robot, "make one with Robot.load(name or file)")
        if differences is not None:
            number("State: differences [s]", differences, 0.0)
        self.robot = robot
        self.t = 0.0
        self._q, self._v = pin.neutral(robot.model), np.zeros(robot.n)
        self.measurement: Measurement | None = None
        self.commanded: Array | None = None
        self.carried: Array | None = None
        self._model, self._data = robot.model, robot.model.createData()
        self._compute = partial(pin.computeJointJacobiansTimeVariation, self._model, self._data,
                                self.q, self.v)
        units = [[part.q, part.size] for part in robot.parts if part.size > 1]
        self._copy = partial(_copy_if_sound, np.array(units, dtype=np.int64).reshape(-1, 2))
        self._further: tuple[Callable[[], object], ...] = ()
        self._compute()
        self.J, self.dJ = _columns(self._data.J, 6), _columns(self._data.dJ, 6)
        self.placements = _placements_view(self._data, robot.model.njoints)
        self.supports = robot.supports
        self.period = differences or 0.0
        self.previous_J = self.J.copy(order="F")
        self.previous_placements = self.placements.copy()
        self._started, self.sound = False, True
        self.kinematics = Kinematics(self.v, self.J, self.dJ, self.placements, self.supports,
                                     self.previous_J, self.previous_placements, self.period)

    @classmethod
    def at(cls, robot: Robot, q: ArrayLike, v: ArrayLike | None = None, t: float = 0.0,
           differences: float | None = None) -> State:
        """Make a State at joint positions q (nq,) [rad or m] and velocities v (n,), zero if None.

        `differences` is the period [s] of backward differences, None for exact derivatives.
        RobotError where a shape is wrong, an entry is not finite, or a quaternion or (cos, sin) has
        another length than one, see `Robot.normalised`.
        """
        expect("State.at: robot", robot, Robot, "make one with Robot.load(name or file)")
        state = cls(robot, differences)
        state.go(q, v, t)
        return state

    def go(self, q: ArrayLike, v: ArrayLike | None = None, t: float = 0.0) -> None:
        """Go where `at` makes a state, and raise what it raises; `move` is for a loop."""
        robot = self.robot
        number("State: t", t)
        v = np.zeros(robot.n) if v is None else v
        if robot.nq == robot.n and _like(q, self.q) and _like(v, self.v) and self.move(t, q, v):
            return
        q = _checked(robot, "q", q, robot.coordinate_names)
        v = _checked(robot, "v", v, robot.velocity_names)
        self.move(t, robot.normalised(q), v)

    def __reduce__(self) -> Any:
        """Copies and pickles have memory of their own."""
        kept = ("t", "_q", "_v", "measurement", "commanded", "carried", "sound", "_started",
                "previous_J", "previous_placements")
        return type(self), (self.robot, self.period or None), {
            name: getattr(self, name) for name in kept}

    def __setstate__(self, kept: dict[str, Any]) -> None:
        q, v, *before = map(kept.pop, ("_q", "_v", "previous_J", "previous_placements"))
        self.move(kept["t"], q, v)
        self.previous_J[:], self.previous_placements[:] = before
        vars(self).update(kept)

    def __repr__(self) -> str:
        return f"State({self.robot!r}, t={self.t:g}, q={numbers(self.q)})"

    @property
    def n(self) -> int:
        """Number of joint velocities."""
        return self.robot.n

    def move(self, t: float, q: Array, v: Array) -> bool:
        """Go to time t [s] at q (nq,), v (n,): the one place of a tick that calls pinocchio.

        If an entry is not finite, or a quaternion or (cos, sin) as a sensor reads it has a length
        more than 1e-3 off one (a smaller difference is taken out), it returns False and changes
        nothing, and until the next `move` a stack refuses the state with a ReadingError. Raises
        RobotError unless q and v are arrays of these shapes.
        """
        try:
            copied = self._copy(q, v, self._q, self._v)
        except (TypeError, ValueError, AttributeError, NumbaError):  # no arrays of numbers
            copied = _MISFIT
        if copied == _MISFIT:
            raise RobotError(f"robot {self.robot.name!r}: State.move: expected arrays q "
                             f"{self.q.shape} and v {self.v.shape}, got {brief(q)} and {brief(v)}")
        self.sound = bool(copied)
        if not copied:
            return False
        if self.period and self._started:
            self._keep_kinematics()
        self.t = t
        self._compute()
        for compute in self._further:
            compute()
        if self.period and not self._started:  # no previous tick: differences are zero
            self._keep_kinematics()
        self._started = True
        return True

    @cached_property
    def dynamics(self) -> Dynamics:
        """M(q) and h(q, v) as views; after the first use, each `move` computes them."""
        data = self._from_now_on((pin.crba, self.q), (pin.nonLinearEffects, self.q, self.v))
        return Dynamics(_columns(data.M, self.n), data.nle)

    @cached_property
    def momentum(self) -> Momentum:
        """The centroidal momentum matrix and its derivative: views, as those of `dynamics`."""
        # Not computeCentroidalMapTimeVariation: its dA is not the derivative of A (pinocchio 4.1).
        data = self._from_now_on((pin.dccrba, self.q, self.v))
        return Momentum(_columns(data.Ag, 6), _columns(data.dAg, 6))

    @cached_property
    def beside(self) -> State:
        """Another state of the robot, to move for differences."""
        return State(self.robot)

    def _from_now_on(self, *calls: tuple[Any, ...]) -> Any:
        """Call functions of pinocchio now and after each `move`; return what they write into."""
        refuse(not self.robot.masses.any(), f"robot {self.robot.name!r} has no masses")
        for function, *read in calls:
            function(self._model, self._data, *read)
            self._further += (partial(function, self._model, self._data, *read),)
        return self._data

    def _keep_kinematics(self) -> None:
        np.copyto(self.previous_J, self.J)
        np.copyto(self.previous_placements, self.placements)

    def mass_matrix(self) -> Array:
        """Joint-space inertia matrix M(q) (n, n) [kg m^2]."""
        return np.ascontiguousarray(pin.crba(self._model, self._data, self.q))

    def bias_effort(self) -> Array:
        """Joint efforts h(q, v) (n,) [N m or N] of gravity, Coriolis and centrifugal forces."""
        return np.asarray(pin.nonLinearEffects(self._model, self._data, self.q, self.v))

    def centre_of_mass(self) -> Array:
        """World position (3,) [m] of the centre of mass of the bodies that joints move."""
        self._from_now_on()  # refuses a robot without masses
        R = self.placements[:, :9].reshape(-1, 3, 3)  # column by column
        points = self.placements[:, 9:] + np.einsum("jki,jk->ji", R, self.robot.centres)
        return np.asarray(self.robot.shares @ points)

    def position(self, frame: Frame | str) -> Array:
        """World position (3,) [m] of the origin of a frame, or of the frame of that name."""
        known = self._frame(frame)
        rotation, translation = self._placement(known.joint)
        return translation + rotation @ known.offset

    def rotation(self, frame: Frame | str) -> Array:
        """World orientation (3, 3) of a frame, or of the frame of that name."""
        known = self._frame(frame)
        return self._placement(known.joint)[0] @ known.rotation

    def _frame(self, frame: Frame | str) -> Frame:
        if isinstance(frame, str):
            return self.robot.frame(frame)
        expect("frame", frame, Frame, "make one with robot.frame(name)")
        self.robot.check_joint(f"frame {frame.name!r}", frame.joint, frame.of)
        return frame

    def _placement(self, joint: int) -> tuple[Array, Array]:
        row = self.placements[joint]
        return row[:9].reshape(3, 3).T, row[9:]


@compiled
def _copy_if_sound(units, q, v, to_q, to_v):
    """Return 1; 0 if an entry is not finite, or a span of `units` has not nearly the length one.

    Or _MISFIT for arrays of other shapes. Spans are (start, size). The copy of one has length one,
    and the same bits where q has it to rounding.
    """
    if q.shape != to_q.shape or v.shape != to_v.shape:
        return _MISFIT
    for i in range(len(q)):
        if not np.isfinite(q[i]):
            return 0
    for i in range(len(v)):
        if not np.isfinite(v[i]):
            return 0
    for k in range(len(units)):
        if not abs(_square(q, units[k, 0], units[k, 1]) - 1.0) <= _OFF:
            return 0
    for i in range(len(q)):
        to_q[i] = q[i]
    for i in range(len(v)):
        to_v[i] = v[i]
    for k in range(len(units)):
        square = _square(q, units[k, 0], units[k, 1])
        for i in range(units[k, 0], units[k, 0] + units[k, 1]):
            to_q[i] /= np.sqrt(square) if abs(square - 1.0) > _EXACT else 1.0
    return 1


@inlined
def _square(q, start, size):
    """Squared length of a span of q."""
    total = 0.0
    for i in range(start, start + size):
        total += q[i] * q[i]
    return total


def _placements_view(data: Any, joints: int) -> Array:
    """One (joints, 12) view over pinocchio's contiguous vector of placements."""
    first = data.oMi[0].rotation
    view = np.lib.stride_tricks.as_strided(first.T.reshape(-1), (joints, 12), (96, 8))
    last = data.oMi[joints - 1]
    if not (np.shares_memory(view, last.translation)
            and (view[-1] == np.r_[last.rotation.T.ravel(), last.translation]).all()):
        raise RobotError("this version of pinocchio has an unknown layout of placements")
    return view


def _columns(matrix: Array, rows: int) -> Array:
    """Return a view with this many rows; pinocchio gives a single column as a vector."""
    return matrix.reshape((rows, -1), order="F")


def _like(value: ArrayLike, array: Array) -> TypeGuard[Array]:
    """Whether a value is an array of the same kind."""
    return (type(value) is np.ndarray and value.dtype == array.dtype
            and value.shape == array.shape and value.flags.c_contiguous)


def _checked(robot: Robot, what: str, value: ArrayLike, names: Sequence[str]) -> Array:
    with naming(f"robot {robot.name!r}", RobotError):
        vector = array_of(what, value)
    if vector.shape != (len(names),):
        more = ("; robot.configuration makes one of the values of joints"
                if what == "q" and robot.nq != robot.n else "")
        raise RobotError(f"robot {robot.name!r}: {what} has shape {vector.shape}, "
                         f"expected ({len(names)},){more}")
    for (i,) in np.argwhere(~np.isfinite(vector))[:1]:
        raise RobotError(f"robot {robot.name!r}: {what}[{i}] ({names[i]}) is {vector[i]}")
    return vector
