"""What a package is asked in the scenes of the arm: a path, a step too fast for it, a NaN."""

from __future__ import annotations

from functools import partial
from typing import Any, final

import numpy as np

from benchmark.arm.scene import Array, RefusedError, scene_of
from benchmark.ticks import Ticks

STEP_TICKS = 2000
_BEFORE_NAN = 3  # ticks


@final
class Questions(Ticks):
    """Ticks of one scene, whose state follows the answers."""

    def __init__(self, kind: Any, options: dict[str, Any]) -> None:
        self.adapter, self.other, self.make = kind, None, partial(kind, **options)

    def open(self, numbers: dict[str, Any], beside: bool = False) -> None:
        """Begin a scene; with `beside` also without the posture, at the same states."""
        self.scene = scene = scene_of(numbers)
        self.t, self.why = 0.0, ""
        self.adapter = self.make(scene, True)
        self.other = self.make(scene, False) if beside else None
        self.q, self.v = np.array(scene.start), np.zeros(len(scene.start))

    def tick(self) -> dict[str, Any]:
        """Ask for a velocity and move with it; zero where there is no finite one."""
        t, q, period = self.t, self.q, self.scene.period
        v, spent = self._velocity(self.adapter)
        again = 0 if v is None or self.other is not None else self.again()
        other = v if self.other is None else self._velocity(self.other)[0]
        failed = v is None or other is None
        still = np.zeros(len(q))
        v, other = still if v is None else v, still if other is None else other
        self.t, self.q, self.v = t + period, q + period * v, v
        return {"t": t, "q": q, "v": v, "other": other, "failed": failed, "time": spent,
                "resolve": again}

    def _velocity(self, adapter: Any) -> tuple[Array | None, int]:
        v, spent = self.asked(adapter.velocity, self.t, self.q, self.v, *self.scene.target(self.t))
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
            v = np.array(self.adapter.velocity(self.t, q, self.v, *self.scene.target(self.t)))
        except RefusedError as refusal:
            return f"says so: {refusal}"
        except Exception as error:
            return f"raises {type(error).__name__}"
        return "a finite answer" if np.isfinite(v).all() else "an answer with NaN"
