"""Linear coupling of joints: gears, mimic joints, fingers that close together."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError, expect, number
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Task


@dataclass(frozen=True)
class JointCoupling(Task):
    """Keep the sum of factor times position over `joints` at `value` (m = 1) [rad or m].

    `joints` has a factor for each joint by name: {"motor": 1.0, "wheel": -50.0} is a gear of ratio
    50. Raises HierarchyError for an unknown joint, one with several coordinates, or no factor.
    """

    robot: Robot
    joints: Mapping[str, float]
    value: float = 0.0
    stiffness: float = 100.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "coupling"
    positions: NDArray[np.int64] = field(init=False, repr=False, compare=False)
    row: Array = field(init=False, repr=False, compare=False)  # (1, n)
    straight = True

    def __post_init__(self) -> None:
        super().__post_init__()
        expect(f"task {self.name!r}: joints", self.joints, Mapping, "give {name: factor, ...}")
        for name, factor in self.joints.items():
            number(f"task {self.name!r}: joints.{name}", factor)
        number(f"task {self.name!r}: value", self.value)
        if not any(self.joints.values()):
            raise HierarchyError(f"task {self.name!r}: joints {dict(self.joints)} have no factor "
                                 "other than zero")
        positions = np.array([self.robot.coordinate(name) for name in self.joints])
        row = np.zeros((1, self.robot.n))
        for place, factor in zip(positions, self.joints.values(), strict=True):
            row[0, self.robot.coordinates == place] = factor
        set_frozen(self, positions=positions, row=row)

    @property
    def dimension(self) -> int:
        """One row."""
        return 1

    @property
    def row_names(self) -> tuple[str, ...]:
        """The joints."""
        return (" and ".join(self.joints),)

    def error(self, state: State) -> Array:
        """The value less the sum (1,) [rad or m]."""
        factors = np.array(list(self.joints.values()))
        return np.array([self.value - float(factors @ state.q[self.positions])])

    def jacobian(self, state: State) -> Array:
        """The factors (1, n)."""
        return self.row

    def jacobian_derivative(self, state: State) -> Array:
        """Zero (1, n)."""
        return np.zeros_like(self.row)
