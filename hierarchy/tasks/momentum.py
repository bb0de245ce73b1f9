"""Linear and angular momentum of the whole robot."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.jit.sources import Kernel
from hierarchy.kinematics import row_times
from hierarchy.measured import Measured, measured
from hierarchy.problem import Array
from hierarchy.state import State

_ROWS = {"both": (0, 6), "linear": (0, 3), "angular": (3, 6)}


@dataclass(frozen=True)
class Momentum(Measured):
    """Bring the momentum of the whole robot to `target`, about its centre of mass.

    `part` is "linear" (m = 3) [kg m/s], "angular" (m = 3) [kg m^2/s] or "both" (m = 6), linear
    first, world axes. At velocity level A v is the target, at the others its derivative is
    damping (target - A v), with `damping` [1/s]. The derivative of A is always exact.

    Raises HierarchyError for another part, or a target of another length. Source: D. Orin,
    A. Goswami, S.-H. Lee, "Centroidal dynamics of a humanoid robot", Autonomous Robots (2013).
    """

    part: Literal["both", "linear", "angular"] = "both"
    target: Sequence[float] | None = None
    damping: float = 10.0
    name: str = "momentum"
    exact = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not isinstance(self.part, str) or self.part not in _ROWS:
            raise HierarchyError(f"task {self.name!r}: part {self.part!r} is not one of "
                                 f"{', '.join(_ROWS)}")
        if self.target is not None and (len(self.target) != self.dimension
                                        or not np.isfinite(self.target).all()):
            raise HierarchyError(f"task {self.name!r}: target {self.target!r} is not "
                                 f"{self.dimension} finite numbers")

    @property
    def dimension(self) -> int:
        """Three rows, or six."""
        return len(self.columns)

    @property
    def row_names(self) -> tuple[str, ...]:
        """Linear and angular momentum along the axes."""
        names = [f"{kind} {axis}" for kind in ("linear", "angular") for axis in "xyz"]
        return tuple(names[i] for i in self.columns)

    def measure(self, state: State) -> tuple[Kernel, Any]:
        """See `Measured.measure`; a momentum has no position, so there is no error."""
        return _momentum, (*state.momentum, self.columns)

    @property
    def columns(self) -> NDArray[np.int64]:
        """The components."""
        return np.arange(*_ROWS[self.part])

    def goal(self, state: State) -> Array:
        """The target in the place of a velocity (3, 6)."""
        goal = np.zeros((3, 6))
        goal[1, self.columns] = 0.0 if self.target is None else self.target
        return goal


@measured
def _momentum(kinematics, reads, goal, J, motion):
    of_robot, rates, rows = reads
    v = kinematics.v
    for i in range(len(rows)):
        for c in range(len(v)):
            J[i, c] = of_robot[rows[i], c]
        motion.rate[i] = row_times(J, i, v)
        motion.drift[i] = row_times(rates, rows[i], v)
