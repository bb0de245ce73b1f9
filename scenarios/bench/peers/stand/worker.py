"""Run one entrant of `stand` in its own process, turn by turn. Needs only numpy and the entrant.

    python -m scenarios.bench.peers.stand.worker MODULE:CLASS OPTIONS SCENE RESULT CORE

As `scenarios.bench.peers.worker`, but the states are those of `states.npz` beside SCENE, from the
first on and then again, so that all answer the same questions.
"""

from __future__ import annotations

import json
import sys
from importlib import import_module, metadata
from pathlib import Path
from time import perf_counter_ns
from typing import Any

import numpy as np

from scenarios.bench.peers.stand.scene import Array, Stand, read_stand
from scenarios.bench.peers.turns import answers, nanoseconds, pin, reason, take_turns


class Ticks:
    """Ticks over recorded states, with their answers and times."""

    def __init__(self, scene: Stand, adapter: Any, states: dict[str, Array]) -> None:
        self.adapter, self.states, self.at, self.why = adapter, states, 0, ""
        self.resolve = getattr(adapter, "resolve", None)
        self.targets = [scene.targets(t) for t in states["t"]]
        joints = len(scene.joints)
        self.none = np.full(joints + 6, np.nan), np.full(joints, np.nan), np.full((2, 6), np.nan)
        self.log: dict[str, list[Any]] = {key: [] for key in (
            "state", "failed", "clocked", "time", "resolve", "a", "torques", "wrenches")}

    def go(self, ticks: int, rehearsed: int) -> None:
        """Run this number of ticks, of which the first `rehearsed` do not count."""
        for k in range(ticks):
            i = self.at % len(self.targets)
            t, q, v = (self.states[key][i] for key in ("t", "q", "v"))
            begin = perf_counter_ns()
            failed = self._tick(float(t), q, v, self.targets[i])
            spent = perf_counter_ns() - begin
            again = 0 if failed else nanoseconds(self.resolve)
            answer = self.none if failed else self.adapter.answer()
            for key, value in zip(self.log, (i, failed, k >= rehearsed, spent, again, *answer),
                                  strict=True):
                self.log[key].append(value)
            self.at += 1

    def _tick(self, t: float, q: Array, v: Array, targets: Array) -> bool:
        """Return whether there was no answer."""
        try:
            self.adapter.tick(t, q, v, targets)
        except Exception as error:
            self.why = self.why or reason(error)
            return True
        return False


def main() -> None:
    """Run from the command line; see the docstring of the module."""
    named, options, file, result, core = sys.argv[1:]
    answer = answers()
    scene = read_stand(Path(file))
    with np.load(Path(file).with_name("states.npz")) as kept:
        states = {key: kept[key] for key in kept.files}
    module, _, name = named.partition(":")
    adapter = getattr(import_module(module), name)(scene, **json.loads(options))
    pin(core)
    ticks = Ticks(scene, adapter, states)

    answer({"version": metadata.version(adapter.package), "priorities": adapter.priorities})
    take_turns(ticks.go, answer)
    np.savez(result, why=ticks.why, allow_pickle=False,
             **{key: np.array(values) for key, values in ticks.log.items()})


if __name__ == "__main__":
    main()
