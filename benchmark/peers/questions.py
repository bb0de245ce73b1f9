"""What a package is asked, in its own process. Needs only numpy."""

from collections.abc import Callable
from functools import partial
from time import perf_counter, perf_counter_ns, process_time
from typing import Any, final

import numpy as np

from benchmark.peers.scenes import Arm, Array, RefusedError, Stand
from benchmark.worker import reason

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
