"""What a package is asked in `stand`: torques at given states, the same for all."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, final

import numpy as np

from benchmark.stand.scene import read_stand
from benchmark.ticks import Ticks


@final
class Questions(Ticks):
    """The states of `states.npz` beside the scene, from the first on and then again."""

    def __init__(self, kind: Any, options: dict[str, Any]) -> None:
        self.adapter, self.make, self.at = kind, partial(kind, **options), 0

    def open(self, file: str) -> None:
        """Read the scene and its states."""
        scene = read_stand(Path(file))
        with np.load(Path(file).with_name("states.npz")) as kept:
            self.states = {key: kept[key] for key in kept.files}
        self.targets = [scene.targets(t) for t in self.states["t"]]
        joints = len(scene.joints)
        self.none = np.full(joints + 6, np.nan), np.full(joints, np.nan), np.full((2, 6), np.nan)
        self.adapter = self.make(scene)

    def tick(self) -> dict[str, Any]:
        """Ask at the next state."""
        i = self.at % len(self.targets)
        self.at += 1
        t, q, v = (self.states[key][i] for key in ("t", "q", "v"))
        done, spent = self.asked(self._ticked, float(t), q, v, self.targets[i])
        again = self.again() if done else 0
        a, torques, wrenches = self.adapter.answer() if done else self.none
        return {"state": i, "failed": not done, "time": spent, "resolve": again, "a": a,
                "torques": torques, "wrenches": wrenches}

    def _ticked(self, *asked: Any) -> bool:
        self.adapter.tick(*asked)
        return True
