"""Run one entrant in its own process, turn by turn. Needs only numpy and the entrant.

    python -m scenarios.bench.peers.worker MODULE:CLASS OPTIONS SCENES RESULT CORE

Each line of stdin is a turn, [number of ticks, how many of them are rehearsal]; the answer is a
line with the seconds it took. At the end of stdin the step is run and all is written to RESULT.
With `nan` as CORE it only says, in JSON, what comes of a NaN among the joint positions.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from importlib import import_module, metadata
from pathlib import Path
from time import perf_counter_ns
from typing import Any

import numpy as np

from scenarios.bench.peers.scene import Array, RefusedError, Scene, read_scenes
from scenarios.bench.peers.turns import answers, nanoseconds, pin, reason, take_turns

STEP_TICKS = 2000
_BEFORE_NAN = 3  # ticks

Make = Callable[[Scene, bool], Any]


class Ticks:
    """Ticks of one scene, with their results and times."""

    def __init__(self, scene: Scene, make: Make, beside: bool = False) -> None:
        self.scene, self.period = scene, scene.period
        self.adapter = make(scene, True)
        self.other = make(scene, False) if beside else None
        self.resolve = getattr(self.adapter, "resolve", None)
        self.t, self.q, self.v = 0.0, np.array(scene.start), np.zeros(len(scene.start))
        self.log: dict[str, list[Any]] = {key: [] for key in (
            "t", "q", "v", "other", "failed", "clocked", "time", "resolve")}
        self.why = ""

    def go(self, ticks: int, rehearsed: int) -> None:
        """Run this number of ticks, of which the first `rehearsed` do not count."""
        for k in range(ticks):
            goal, rate = self.scene.target(self.t)
            begin = perf_counter_ns()
            v, failed = self._velocity(self.adapter, goal, rate)
            spent = perf_counter_ns() - begin
            again = 0 if failed else nanoseconds(self.resolve)
            other = v
            if self.other is not None:
                other, also = self._velocity(self.other, goal, rate)
                failed = failed or also
            for key, value in zip(self.log, (self.t, self.q, v, other, failed, k >= rehearsed,
                                             spent, again), strict=True):
                self.log[key].append(value)
            self.t, self.q, self.v = self.t + self.period, self.q + self.period * v, v

    def _velocity(self, adapter: Any, goal: Array, rate: Array) -> tuple[Array, bool]:
        """Return the velocity; zero and a failure if there is no finite one."""
        try:
            v = np.array(adapter.velocity(self.t, self.q, self.v, goal, rate))
        except Exception as error:
            self.why = self.why or reason(error)
            return np.zeros(len(self.q)), True
        if np.isfinite(v).all():
            return v, False
        self.why = self.why or "an answer that is not finite"
        return np.zeros(len(self.q)), True

    def arrays(self, prefix: str) -> dict[str, Array]:
        """Return the log as arrays for a file."""
        return {f"{prefix}{key}": np.array(values) for key, values in self.log.items()}


def after_nan(scene: Scene, make: Make) -> str:
    """Return the reaction of an adapter to a NaN in joint 3 after a few normal ticks."""
    ticks = Ticks(scene, make)
    ticks.go(_BEFORE_NAN, 0)
    q = ticks.q.copy()
    q[2] = np.nan
    try:
        v = np.array(ticks.adapter.velocity(ticks.t, q, ticks.v, *scene.target(ticks.t)))
    except RefusedError as refusal:
        return f"says so: {refusal}"
    except Exception as error:
        return f"raises {type(error).__name__}"
    return "a finite answer" if np.isfinite(v).all() else "an answer with NaN"


def main() -> None:
    """Run from the command line; see the docstring of the module."""
    named, options, scenes_file, result, core = sys.argv[1:]
    answer = answers()
    scenes = read_scenes(Path(scenes_file))
    module, _, name = named.partition(":")
    kind, settings = getattr(import_module(module), name), json.loads(options)

    def make(scene: Scene, posture: bool) -> Any:
        return kind(scene, posture, **settings)

    if core == "nan":
        answer(after_nan(scenes["ellipse"], make))
        return
    pin(core)
    ellipse = Ticks(scenes["ellipse"], make)
    answer({"version": metadata.version(kind.package), "priorities": kind.priorities,
            "rows": kind.rows})
    take_turns(ellipse.go, answer)
    step = Ticks(scenes["step"], make, beside=True)
    step.go(STEP_TICKS, 0)
    np.savez(result, why=ellipse.why, step_why=step.why, allow_pickle=False,
             **ellipse.arrays(""), **step.arrays("step_"))


if __name__ == "__main__":
    main()
