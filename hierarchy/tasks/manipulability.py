"""Manipulability of a frame: its distance from a singular posture, kept or raised.

w = sqrt(det(J J^T)), with J the Jacobian of the frame (Yoshikawa, "Manipulability of Robotic
Mechanisms", 1985). With the screws S_i of the joints, the columns of the world-frame Jacobian,
dS_k/dq_i = S_i x S_k for every joint i that moves joint k, x being the product of motions; so the
gradient of w and its time derivative are known without differences.
"""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from hierarchy.errors import HierarchyError, number
from hierarchy.jit import compiled
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Kind
from hierarchy.tasks.geometric import Geometric, View, crossed, plus, rates_of, view_of

_SINGULAR = 1e-12  # w below which it has no gradient


@dataclass(frozen=True)
class Manipulability(Geometric):
    """Keep the manipulability w of `frame` at `least` or above (m = 1).

    `part` "position" counts the three linear rows of its Jacobian, "pose" all six, which mixes
    metres and radians. With kind = "equality" w goes to `least`. At a singular posture the row is
    zero: it keeps away from there, but does not lead out. For robots whose joints each have one
    velocity, on a fixed base.
    """

    frame: Frame
    least: float
    part: Literal["position", "pose"] = "position"
    kind: Kind = "inequality"
    stiffness: float = 20.0
    damping: float = 10.0
    gain: float = 5.0
    name: str = "manipulability"

    def __post_init__(self) -> None:
        super().__post_init__()
        number(f"task {self.name!r}: least", self.least, 0.0)
        if self.part not in ("position", "pose"):
            raise HierarchyError(f"task {self.name!r}: part must be 'position' or 'pose', got "
                                 f"{self.part!r}")

    @property
    def dimension(self) -> int:
        """One row."""
        return 1

    def error(self, state: State) -> Array:
        """`least` minus w (1,), positive where w is too small."""
        return np.array([self.least - self.value(state)])

    def value(self, state: State) -> float:
        """w at a state."""
        return _measure(self._jacobian(view_of(state)))

    def rows(self, view: View) -> Array:
        """w tr((J J^T)^-1 dJ/dq_i J^T), one column per joint: (1, n)."""
        J = self._jacobian(view)
        w = _measure(J)
        if w < _SINGULAR:
            return np.zeros((1, J.shape[1]))
        inverse = J.T @ np.linalg.inv(J @ J.T)
        return np.asarray(w * _traces(self._gradient(view), inverse)[None])

    def rows_derivative(self, state: State) -> Array:
        """The derivative of `rows`, with d(J+)/dt out of J+ = J^T (J J^T)^-1."""
        view = view_of(state)
        J, D = self._jacobian(view), self._gradient(view)
        w = _measure(J)
        if w < _SINGULAR:
            return np.zeros((1, state.n))
        rates = rates_of(state, self.frame, view.frame(self.frame))
        dJ = np.vstack([rates.dJ, rates.dW])[:len(J)]
        square = np.linalg.inv(J @ J.T)
        inverse = J.T @ square
        dinverse = dJ.T @ square - inverse @ (dJ @ J.T + J @ dJ.T) @ square
        along = _traces(D, inverse)
        dw = w * float(along @ state.v)
        turned = _traces(self._gradient_rate(state), inverse) + _traces(D, dinverse)
        return np.asarray((dw * along + w * turned)[None])

    def _jacobian(self, view: View) -> Array:
        placed = view.frame(self.frame)
        return placed.J if self.part == "position" else np.vstack([placed.J, placed.W])

    def _gradient(self, view: View) -> Array:
        """dJ/dq_i of the frame (n, rows, n), the joint of the derivative first."""
        placed = view.frame(self.frame)
        out = np.empty((self._joints(view), *self._jacobian(view).shape))
        _write_gradient(view.J, view.supports, self.frame.joint, placed.p, placed.J, out)
        return out

    def _gradient_rate(self, state: State) -> Array:
        """Time derivative of `_gradient` (n, rows, n)."""
        view = view_of(state)
        placed = view.frame(self.frame)
        rates, out = rates_of(state, self.frame, placed), self._gradient(view)
        _write_gradient_rate(state.J, state.dJ, view.supports, self.frame.joint,
                             np.array([placed.p, rates.v]), placed.J, rates.dJ, out)
        return out

    def _joints(self, view: View) -> int:
        """Return n; raises HierarchyError for a joint with several velocities."""
        n = int(view.supports.shape[1])
        if len(view.supports) != n + 1:
            raise HierarchyError(f"task {self.name!r}: a joint of the robot has several "
                                 "velocities, or the base floats")
        return n


def _traces(D: Array, B: Array) -> Array:
    """tr(D_i B) of each D_i (rows, n): (n,)."""
    return np.asarray(D.reshape(len(D), -1) @ B.T.ravel())


def _measure(J: Array) -> float:
    """The product of the singular values, which is more exact than a determinant."""
    return float(np.prod(np.linalg.svd(J, compute_uv=False)))


@compiled
def _write_gradient(J, supports, joint, p, linear, out):
    """Write dJ/dq_i of the frame on `joint` at p into out (n, rows, n); linear (3, n) its J."""
    out[:] = 0.0
    for k in range(J.shape[1]):
        if not supports[joint, k]:
            continue
        V, W = (J[0, k], J[1, k], J[2, k]), (J[3, k], J[4, k], J[5, k])
        for i in range(J.shape[1]):
            vi, wi = (J[0, i], J[1, i], J[2, i]), (J[3, i], J[4, i], J[5, i])
            dV = dW = (0.0, 0.0, 0.0)
            if i != k and supports[k + 1, i]:  # joint i moves the screw of joint k
                dV, dW = plus(crossed(wi, V), crossed(vi, W)), crossed(wi, W)
            moved = plus(dV, crossed(dW, (p[0], p[1], p[2])))
            moved = plus(moved, crossed(W, (linear[0, i], linear[1, i], linear[2, i])))
            for r in range(out.shape[1]):
                out[i, r, k] = moved[r] if r < 3 else dW[r - 3]


@compiled
def _write_gradient_rate(J, dJ, supports, joint, motion, linear, dlinear, out):
    """Write the time derivative of `_write_gradient` into out; motion (2, 3) is p and dp/dt."""
    out[:] = 0.0
    p = (motion[0, 0], motion[0, 1], motion[0, 2])
    dp = (motion[1, 0], motion[1, 1], motion[1, 2])
    for k in range(J.shape[1]):
        if not supports[joint, k]:
            continue
        V, W = (J[0, k], J[1, k], J[2, k]), (J[3, k], J[4, k], J[5, k])
        aV, aW = (dJ[0, k], dJ[1, k], dJ[2, k]), (dJ[3, k], dJ[4, k], dJ[5, k])
        for i in range(J.shape[1]):
            vi, wi = (J[0, i], J[1, i], J[2, i]), (J[3, i], J[4, i], J[5, i])
            avi, awi = (dJ[0, i], dJ[1, i], dJ[2, i]), (dJ[3, i], dJ[4, i], dJ[5, i])
            dW = bV = bW = (0.0, 0.0, 0.0)
            if i != k and supports[k + 1, i]:
                dW = crossed(wi, W)
                bV = plus(plus(crossed(awi, V), crossed(wi, aV)),
                          plus(crossed(avi, W), crossed(vi, aW)))
                bW = plus(crossed(awi, W), crossed(wi, aW))
            moved = plus(plus(bV, crossed(bW, p)), crossed(dW, dp))
            moved = plus(moved, crossed(aW, (linear[0, i], linear[1, i], linear[2, i])))
            moved = plus(moved, crossed(W, (dlinear[0, i], dlinear[1, i], dlinear[2, i])))
            for r in range(out.shape[1]):
                out[i, r, k] = moved[r] if r < 3 else bW[r - 3]
