"""What a package is asked of whole inverse kinematics: a configuration for each pose."""

from __future__ import annotations

from time import perf_counter
from typing import Any, final

import numpy as np


@final
class Questions:
    """The poses of a file, one after the other, each with configurations to start from."""

    def __init__(self, kind: type[Any], options: dict[str, Any]) -> None:
        self.kind, self.options = kind, options

    def about(self) -> dict[str, Any]:
        """Return nothing."""
        return {}

    def open(self, file: str) -> None:
        """Read the robot, frames and poses, and solve the first, which loads and compiles."""
        with np.load(file) as data:
            self.adapter = self.kind(str(data["urdf"]), data["frames"].tolist(),
                                     float(data["tolerance"]), **self.options)
            self.poses, self.starts = data["poses"], data["starts"]
        self.adapter.solve(self.poses[0], self.starts[0])

    def problem(self, p: int) -> dict[str, Any]:
        """Return the configuration for a pose, whether it is met, and the time [s]."""
        clock = perf_counter()
        q, met = self.adapter.solve(self.poses[p], self.starts[p])
        return {"q": q, "met": bool(met), "seconds": perf_counter() - clock}
