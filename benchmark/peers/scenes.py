"""What a package is asked in its own process: scenes as plain numbers, and ticks. Needs only numpy.

An adapter is a module with some of these functions:

    arm(scene, posture, **options)           -> velocity, resolve
    stand(scene, **options)                  -> tick, resolve
    reach(file, frames, tolerance, **options) -> solve

velocity(t, q, v, goal, rate) returns joint velocities (n,), one whole tick: q, v (n,) are joint
positions and the velocities with which they were reached, goal (3,) [m] and rate (3,) [m/s] those
of the path at t [s]; `posture` says whether the posture is asked for. tick(t, q, v, targets) does
one whole tick and returns what reads its `Answer`: q (n + 1,) has the base's position and
quaternion (x, y, z, w) first, v (n,) the base's velocity in its own axes; targets (3, 3, 3) are
position, velocity and acceleration of the centre of mass and both hands. resolve() solves the last
tick's problem again and nothing else; None where a package cannot. solve(poses, starts) returns the
best configuration for poses (frames, 4, 4) from starts (s, nq), and whether it is within the
tolerance. Any exception is a failure.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from time import perf_counter, perf_counter_ns, process_time
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from benchmark.worker import reason

Array = NDArray[np.float64]
Numbers = Sequence[float]
Gains = tuple[float, float, float]


class RefusedError(Exception):
    """Raised by an adapter whose package reports failure without an exception."""


@final
@dataclass(frozen=True)
class Arm:
    """An arm, a path for its end effector, a posture of lower priority, velocity limits.

    file : the URDF; frame : its end effector; joints : their names.
    centre, cosine, sine (3,) [m], turning [rad/s] : the path, centre + cosine cos + sine sin.
    start, posture (n,) [rad]; limit (n,) [rad/s]; gain, posture_gain [1/s] : a velocity asked for
    is the path's (the posture's is zero) and gain times the error. ratio : of weights or costs of
    position to posture, for those that have no levels; period [s].
    """

    file: str
    frame: str
    joints: Sequence[str]
    start: Numbers
    limit: Numbers
    posture: Numbers
    centre: Numbers
    cosine: Numbers = (0.0, 0.0, 0.0)
    sine: Numbers = (0.0, 0.0, 0.0)
    turning: float = 0.0
    gain: float = 20.0
    posture_gain: float = 5.0
    ratio: float = 1000.0
    period: float = 1e-3

    def target(self, t: float) -> Array:
        """Position [m] and velocity [m/s] of the path at t [s]: (2, 3)."""
        return circle(t, self.centre, self.cosine, self.sine, self.turning)[:2]

    def wanted(self, p: Array, goal: Array, rate: Array) -> Array:
        """Velocity (3,) [m/s] asked of the end effector at p (3,) [m]."""
        return rate + self.gain * (goal - p)

    def after(self, p: Array, goal: Array, rate: Array) -> Array:
        """Position (3,) [m] one period later with that velocity."""
        return p + self.period * self.wanted(p, goal, rate)

    def still(self, q: Array) -> Array:
        """Velocity (n,) [rad/s] that the posture asks for at q (n,) [rad]."""
        return self.posture_gain * (np.array(self.posture) - q)


class Answer(NamedTuple):
    """What a package wants of the humanoid at one state.

    a (n,) accelerations; torques (n - 6,) [N m]; wrenches (feet, 6): force [N] and moment [N m]
    about the middle of each sole, on the robot, in world axes.
    """

    a: Array
    torques: Array
    wrenches: Array


@final
@dataclass(frozen=True)
class Stand:
    """A humanoid on two soles: circles of its centre of mass and hands, a posture, least forces.

    file : the URDF; joints : their names, in the order of the posture (n - 6,) [rad] and torque
    limits (n - 6,) [N m]; soles, hands : frames. half : of length and width of a sole [m].
    friction : of the pyramid's faces, f_t <= friction f_n along each axis of the sole.
    circles : centre, cosine, sine (3,) [m] and rate [rad/s] of centre of mass, left and right hand.
    rest (n + 1,) : where the soles touch the floor. contact, com, hand, joint : stiffness [1/s^2],
    damping [1/s], and weight of the rows where there are no levels; force : weight of the least.
    """

    file: str
    joints: Sequence[str]
    soles: Sequence[str]
    hands: Sequence[str]
    rest: Numbers
    posture: Numbers
    torque: Numbers
    circles: Sequence[Any]
    half: Numbers = (0.105, 0.04)
    friction: float = 0.4
    contact: Gains = (100.0, 20.0, 1.0)
    com: Gains = (40.0, 13.0, 1.0)
    hand: Gains = (100.0, 20.0, 1.0)
    joint: Gains = (30.0, 11.0, 0.3)
    force: float = 3e-3
    period: float = 1e-3

    @property
    def corners(self) -> Array:
        """The corners of a sole in its frame (4, 3) [m]."""
        x, y = self.half
        return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])

    def targets(self, t: float) -> Array:
        """Position, velocity, acceleration of centre of mass and hands at t [s]: (3, 3, 3)."""
        return np.array([circle(t, *one) for one in self.circles])


def circle(t: float, centre: Numbers, cosine: Numbers, sine: Numbers, rate: float) -> Array:
    """Return position, velocity and acceleration at t [s] of centre + cosine cos + sine sin."""
    c, s, a, b = np.cos(rate * t), np.sin(rate * t), np.array(cosine), np.array(sine)
    out = c * a + s * b
    return np.array([centre + out, rate * (c * b - s * a), -(rate**2) * out])


def wrench(rotation: Array, points: Array, forces: Array) -> Array:
    """Return the wrench (6,) in world axes of forces (p, 3) at points (p, 3), both in a frame."""
    return np.concatenate([rotation @ forces.sum(axis=0),
                           rotation @ np.cross(points, forces).sum(axis=0)])


_BEFORE_NAN = 3  # ticks


class _Ticks:
    """Ticks one after the other; `why` is the reason of the first failure."""

    why = ""
    resolve: Callable[[], Any] | None = None

    def __init__(self, make: Callable[..., Any], options: dict[str, Any]) -> None:
        self.make = partial(make, **options)

    def tick(self) -> dict[str, Any]:
        """Run one tick; return what is to be kept of it."""
        raise NotImplementedError

    def turn(self, ticks: int, rehearsed: int) -> dict[str, Any]:
        """Run this number of ticks, of which the first `rehearsed` do not count; return the log."""
        log: dict[str, list[Any]] = {}
        begin = process_time()
        for k in range(ticks):
            for key, value in {**self.tick(), "clocked": k >= rehearsed}.items():
                log.setdefault(key, []).append(value)
        return {"log": log, "why": self.why, "busy_s": process_time() - begin}

    def _asked(self, call: Callable[..., Any], *arguments: Any) -> tuple[Any, int]:
        """Return what a call returns, None if it raises, and how long it took [ns]."""
        begin = perf_counter_ns()
        try:
            found = call(*arguments)
        except Exception as error:
            self.why = self.why or reason(error)
            found = None
        return found, perf_counter_ns() - begin

    def _again(self) -> int:
        """Return how long the solve of the last tick takes alone [ns]; 0 if it is not to be had."""
        return 0 if self.resolve is None else self._asked(self.resolve)[1]


@final
class Moving(_Ticks):
    """Ticks of an arm, whose state follows the answers."""

    def open(self, numbers: dict[str, Any], beside: bool = False) -> None:
        """Begin a scene; with `beside` also without the posture, at the same states."""
        self.scene = scene = Arm(**numbers)
        self.t, self.why = 0.0, ""
        self.velocity, self.resolve = self.make(scene, True)
        self.other = self.make(scene, False)[0] if beside else None
        self.q, self.v = np.array(scene.start), np.zeros(len(scene.start))

    def tick(self) -> dict[str, Any]:
        """Ask for a velocity and move with it; zero where there is no finite one."""
        t, q, period = self.t, self.q, self.scene.period
        v, spent = self._velocity(self.velocity)
        again = 0 if v is None or self.other is not None else self._again()
        other = v if self.other is None else self._velocity(self.other)[0]
        failed = v is None or other is None
        still = np.zeros(len(q))
        v, other = still if v is None else v, still if other is None else other
        self.t, self.q, self.v = t + period, q + period * v, v
        return {"t": t, "q": q, "v": v, "other": other, "failed": failed, "time": spent,
                "resolve": again}

    def _velocity(self, call: Callable[..., Any]) -> tuple[Array | None, int]:
        v, spent = self._asked(call, self.t, self.q, self.v, *self.scene.target(self.t))
        if v is None or np.isfinite(v := np.array(v)).all():
            return v, spent
        self.why = self.why or "an answer that is not finite"
        return None, spent

    def after_nan(self) -> str:
        """Return the reaction to a NaN in joint 3 after a few normal ticks."""
        self.turn(_BEFORE_NAN, 0)
        q = self.q.copy()
        q[2] = np.nan
        try:
            v = np.array(self.velocity(self.t, q, self.v, *self.scene.target(self.t)))
        except RefusedError as refusal:
            return f"says so: {refusal}"
        except Exception as error:
            return f"raises {type(error).__name__}"
        return "a finite answer" if np.isfinite(v).all() else "an answer with NaN"


@final
class Standing(_Ticks):
    """Ticks of a humanoid at given states, from the first on and then again."""

    def open(self, numbers: dict[str, Any], states: dict[str, Any]) -> None:
        """Take the scene and its states: lists t, q and v."""
        self.scene, self.at = Stand(**numbers), 0
        self.states = [(t, np.array(q), np.array(v), self.scene.targets(t)) for t, q, v in zip(
            *(states[key] for key in ("t", "q", "v")), strict=True)]
        joints = len(self.scene.joints)
        self.none = np.full(joints + 6, np.nan), np.full(joints, np.nan), np.full((2, 6), np.nan)
        self.call, self.resolve = self.make(self.scene)

    def tick(self) -> dict[str, Any]:
        """Ask at the next state."""
        i = self.at % len(self.states)
        self.at += 1
        answer, spent = self._asked(self.call, *self.states[i])
        again = 0 if answer is None else self._again()
        a, torques, wrenches = self.none if answer is None else answer()
        return {"state": i, "failed": answer is None, "time": spent, "resolve": again, "a": a,
                "torques": torques, "wrenches": wrenches}


@final
class Reaching:
    """Poses to reach, one after the other, with whichever robot."""

    def __init__(self, make: Callable[..., Any], options: dict[str, Any]) -> None:
        self.make, self.robot = partial(make, **options), list[Any]()

    def problem(self, robot: list[Any], poses: Any, starts: Any) -> dict[str, Any]:
        """Return the configuration for poses (frames, 4, 4), whether they are met, the time [s].

        robot : URDF, frames and tolerance; a new one solves once before, which loads and compiles.
        """
        asked = np.array(poses), np.array(starts)
        if robot != self.robot:
            self.solve, self.robot = self.make(*robot), robot
            self.solve(*asked)
        clock = perf_counter()
        q, met = self.solve(*asked)
        return {"q": q, "met": bool(met), "seconds": perf_counter() - clock}
