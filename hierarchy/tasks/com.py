"""The whole robot: its centre of mass along a path, its linear and angular momentum."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import finite_numbers
from hierarchy.kinematics import carried, moving_point, place, plus, row_times, times
from hierarchy.measured import Measure, Measured, measured
from hierarchy.paths import Path
from hierarchy.problem import Array
from hierarchy.robot import Robot
from hierarchy.state import State


@dataclass(frozen=True)
class CentreOfMass(Measured):
    """Move the robot's centre of mass along `path` in the chosen world axes [m].

    `axes` are some of 0, 1, 2 for x, y, z in increasing order, one row per axis: (0, 1) leaves the
    height free, which is enough for standing. p = sum m_i p_i / sum m_i over the bodies that joints
    move. Raises HierarchyError if the robot has no masses.
    """

    robot: Robot
    path: Path
    axes: tuple[int, ...] = (0, 1, 2)
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "centre of mass"

    def __post_init__(self) -> None:
        super().__post_init__()
        axes = finite_numbers(f"task {self.name!r}: axes", self.axes).tolist()
        self.refuse(not {*axes} <= {0, 1, 2} or axes != sorted({*axes}), f"axes {self.axes} must "
                    "be some of 0, 1, 2, in this order")
        self.refuse(not self.robot.masses.sum() > 0.0, f"robot {self.robot.name!r} has no masses")

    @property
    def row_names(self) -> tuple[str, ...]:
        """The axes of the world."""
        return tuple("xyz"[axis] for axis in self.columns)

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        return _centre_of_mass, (self.robot.shares, self.robot.centres, self.columns)

    @property
    def columns(self) -> NDArray[np.int64]:
        """The axes."""
        return np.array(self.axes, dtype=np.int64)


@measured
def _centre_of_mass(kinematics, reads, goal, J, motion):
    """Column c is s J_v + J_w x m, with s and m the mass and moment (as shares) that c moves."""
    shares, centres, axes = reads
    columns, placements, supports = kinematics.J, kinematics.placements, kinematics.supports
    for c in range(J.shape[1]):
        s, m = 0.0, (0.0, 0.0, 0.0)
        for joint in range(1, len(shares)):
            if supports[joint, c] and shares[joint] > 0.0:
                s += shares[joint]
                m = plus(m, times(shares[joint], place(placements[joint], centres[joint])))
        moved = carried(times(s, columns[:3, c]), columns[3:, c], m)
        for i in range(len(axes)):
            J[i, c] = moved[axes[i]]
    p, drift = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for joint in range(1, len(shares)):
        if shares[joint] > 0.0:
            _, bend, _ = moving_point(kinematics, joint, centres[joint])
            p = plus(p, times(shares[joint], place(placements[joint], centres[joint])))
            drift = plus(drift, times(shares[joint], bend))
    for i in range(len(axes)):
        motion.error[i] = goal[0, axes[i]] - p[axes[i]]
        motion.rate[i] = row_times(J, i, kinematics.v)
        motion.drift[i] = drift[axes[i]]


_MOMENTA = tuple(f"{kind} {axis}" for kind in ("linear", "angular") for axis in "xyz")
_PARTS = {"both": slice(0, 6), "linear": slice(0, 3), "angular": slice(3, 6)}


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
        if self.target is not None:
            finite_numbers(f"task {self.name!r}: target", self.target, self.dimension)

    @property
    def row_names(self) -> tuple[str, ...]:
        """Linear and angular momentum along the axes."""
        return _MOMENTA[_PARTS[self.part]]

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`; a momentum has no position, so there is no error."""
        return _momentum, (*state.momentum, _PARTS[self.part].start)

    def follow(self, state: State, goal: Array) -> Callable[[float], object] | None:
        """The target is in the place of a velocity."""
        place, target = goal[1, :self.dimension], 0.0 if self.target is None else self.target
        place[:] = target
        return (lambda t: np.copyto(place, target)) if isinstance(target, np.ndarray) else None


@measured
def _momentum(kinematics, reads, goal, J, motion):
    of_robot, rates, first = reads
    v = kinematics.v
    for i in range(len(J)):
        for c in range(len(v)):
            J[i, c] = of_robot[first + i, c]
        motion.rate[i] = row_times(J, i, v)
        motion.drift[i] = row_times(rates, first + i, v)
