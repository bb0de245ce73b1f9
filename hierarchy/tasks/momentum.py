"""Linear and angular momentum of the whole robot."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import row_times, write_equality
from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.task import Level, Task

_ROWS = {"both": (0, 6), "linear": (0, 3), "angular": (3, 6)}


@dataclass(frozen=True)
class Momentum(Task):
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
        return len(self._rows)

    @property
    def row_names(self) -> tuple[str, ...]:
        """Linear and angular momentum along the axes."""
        names = [f"{kind} {axis}" for kind in ("linear", "angular") for axis in "xyz"]
        return tuple(names[i] for i in self._rows)

    def error(self, state: State) -> Array:
        """Zero (m,): a momentum has no position."""
        return np.zeros(self.dimension)

    def jacobian(self, state: State) -> Array:
        """Rows of the centroidal momentum matrix A (m, n)."""
        return np.ascontiguousarray(state.momentum.A[self._rows])

    def jacobian_derivative(self, state: State) -> Array:
        """Its time derivative (m, n)."""
        return np.ascontiguousarray(state.momentum.dA[self._rows])

    def desired_velocity(self, state: State) -> Array:
        """The target (m,)."""
        return np.zeros(self.dimension) if self.target is None else np.array(self.target, float)

    def writer(self, state: State, level: Level, A: Array, lower: Array, upper: Array,
               row: int) -> Callable[[], object]:
        """See `Task.writer`."""
        parameters = _Parameters(*state.momentum, self._rows, self.desired_velocity(state),
                                 self.damping, level == "acceleration")
        return bind(_write, state.v, parameters, A, lower, upper, row)

    @property
    def _rows(self) -> NDArray[np.int64]:
        return np.arange(*_ROWS[self.part])


class _Parameters(NamedTuple):
    A: Array
    dA: Array  # noqa: N815
    rows: NDArray[np.int64]
    target: Array
    damping: float
    acceleration: bool


@compiled
def _write(v, parameters, A, lower, upper, row):
    of_robot, rates, rows, target, damping, acceleration = parameters
    for i in range(len(rows)):
        for c in range(len(v)):
            A[row + i, c] = of_robot[rows[i], c]
        b = target[i]
        if acceleration:
            b = damping * (b - row_times(A, row + i, v)) - row_times(rates, rows[i], v)
        write_equality(lower, upper, row + i, b)
