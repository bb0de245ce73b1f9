"""Manipulability of a frame: its distance from a singular posture, kept or raised.

w = sqrt(det(J J^T)), with J the Jacobian of the frame (Yoshikawa, "Manipulability of Robotic
Mechanisms", 1985). A joint turns the columns of those after it, and moves the frame that those
before it turn, so the gradient of w and its time derivative are known without differences.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hierarchy.kinematics import Kinematics, Placed, cross
from hierarchy.measured import Measure, Measured, Motion, plain
from hierarchy.problem import Array
from hierarchy.records import NotNegative
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Kind

_SINGULAR = 1e-12  # w below which it has no gradient
_CROSS: Array = np.array([cross(axis) for axis in np.eye(3)])


@dataclass(frozen=True)
class Manipulability(Measured):
    """Keep the manipulability w of `frame` at `least` or above (m = 1).

    `part` "position" counts the three linear rows of its Jacobian, "pose" all six, which mixes
    metres and radians. With kind = "equality" w goes to `least`. At a singular posture the row is
    zero: it keeps away from there, but does not lead out. For robots on a fixed base, with at least
    as many joints as rows, each of one velocity.
    """

    frame: Frame
    least: NotNegative
    part: Literal["position", "pose"] = "position"
    kind: Kind = "inequality"
    stiffness: float = 20.0
    damping: float = 10.0
    gain: float = 5.0
    name: str = "manipulability"
    dimension = 1

    def value(self, state: State) -> float:
        """w at a state."""
        return float(self.least - self.error(state)[0])

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`; HierarchyError for a robot that this task is not for."""
        self.refuse(len(state.supports) != state.n + 1, "a joint of the robot has several "
                    "velocities, or the base floats")
        rows = 3 if self.part == "position" else 6
        self.refuse(state.n < rows, f"robot {state.robot.name!r} has {state.n} joints, so the "
                    f"manipulability of {rows} rows is 0 everywhere")
        return _manipulability, (self.frame, self.least, slice(rows))


@plain
def _manipulability(kinematics: Kinematics, reads: tuple[Frame, float, slice], goal: Array,
                    J: Array, motion: Motion) -> None:
    """The row is w tr(J^+ dJ/dq_i), with the derivative of J^+ = J^T (J J^T)^-1 in its drift.

    w is the product of the singular values, which is more exact than a determinant.
    """
    frame, least, rows = reads
    placed, v = Placed.of(kinematics, frame), kinematics.v
    K, dK = placed.J[rows], placed.dJ[rows]
    U, lengths, V = np.linalg.svd(K, full_matrices=False)
    w = lengths.prod()
    motion.error[0], motion.rate[0], motion.drift[0], J[:] = least - w, 0.0, 0.0, 0.0
    if w < _SINGULAR:
        return
    square, inverse = (U / lengths**2) @ U.T, (V.T / lengths) @ U.T
    dinverse = dK.T @ square - inverse @ (dK @ K.T + K @ dK.T) @ square
    D = _gradient(placed.J, placed.J)[:, rows]
    dD = (_gradient(placed.dJ, placed.J) + _gradient(placed.J, placed.dJ))[:, rows]
    along = _traces(D, inverse)
    J[0] = w * along
    motion.rate[0] = J[0] @ v
    motion.drift[0] = w * (along @ v)**2 + w * (_traces(dD, inverse) + _traces(D, dinverse)) @ v


def _traces(D: Array, B: Array) -> Array:
    """tr(D_i B) of each D_i (rows, n): (n,)."""
    return np.asarray(D.reshape(len(D), -1) @ B.T.ravel())


def _gradient(turning: Array, turned: Array) -> Array:
    """dJ/dq_i (n, 6, n) of a frame with the Jacobian J (6, n), for both arguments, in each linear.

    Column k turns with a joint i before it, w_i x (v_k, w_k); a joint after it moves the frame that
    it turns, w_k x v_i.
    """
    crosses = np.tensordot(turning[3:].T, _CROSS, 1)
    linear, angular = crosses @ turned[:3], crosses @ turned[3:]
    first = np.tri(len(crosses), dtype=bool).T[:, None]
    return np.concatenate([np.where(first, linear, linear.transpose(2, 1, 0)),
                           np.where(first, angular, 0.0)], axis=1)
