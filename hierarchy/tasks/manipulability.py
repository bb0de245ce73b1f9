"""Manipulability of a frame: its distance from a singular posture, kept or raised.

w = sqrt(det(J J^T)), with J the Jacobian of the frame (Yoshikawa, "Manipulability of Robotic
Mechanisms", 1985). With the screws S_i of the joints, the columns of the world-frame Jacobian,
dS_k/dq_i = S_i x S_k for every joint i that moves joint k, x being the product of motions; so the
gradient of w and its time derivative are known without differences.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Kind, check_parts
from hierarchy.tasks.geometric import Geometric, View, rates_of, view_of

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
        check_parts(self)
        if not 0.0 <= self.least < np.inf:
            raise HierarchyError(f"task {self.name!r}: least = {self.least} must not be negative")
        if self.part not in ("position", "pose"):
            raise HierarchyError(f"task {self.name!r}: part must be 'position' or 'pose', got "
                                 f"{self.part!r}")

    @property
    def dimension(self) -> int:
        """One row."""
        return 1

    def error(self, state: State) -> Array:
        """What w lacks (1,), positive where it is too small."""
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
        inverse = np.linalg.pinv(J)
        return np.asarray(w * np.einsum("irk,kr->i", self._gradient(view), inverse)[None])

    def rows_derivative(self, state: State) -> Array:
        """The derivative of `rows`, with d(J+)/dt out of J+ = J^T (J J^T)^-1."""
        view = view_of(state)
        J, D = self._jacobian(view), self._gradient(view)
        w = _measure(J)
        if w < _SINGULAR:
            return np.zeros((1, state.n))
        rates = rates_of(state, self.frame, view.frame(self.frame))
        dJ = np.vstack([rates.dJ, rates.dW])[:len(J)]
        inverse, square = np.linalg.pinv(J), np.linalg.inv(J @ J.T)
        dinverse = dJ.T @ square - inverse @ (dJ @ J.T + J @ dJ.T) @ square
        along = np.einsum("irk,kr->i", D, inverse)
        dw = w * float(along @ state.v)
        turned = (np.einsum("irk,kr->i", self._gradient_rate(state), inverse)
                  + np.einsum("irk,kr->i", D, dinverse))
        return np.asarray((dw * along + w * turned)[None])

    def _jacobian(self, view: View) -> Array:
        placed = view.frame(self.frame)
        return placed.J if self.part == "position" else np.vstack([placed.J, placed.W])

    def _gradient(self, view: View) -> Array:
        """dJ/dq_i of the frame (n, rows, n), the joint of the derivative first."""
        placed = view.frame(self.frame)
        V, W = view.J[:3].T, view.J[3:].T  # of the screws, (n, 3)
        moves = self._moves(view.supports)[..., None]
        dV = moves * (_cross(W[:, None], V[None]) + _cross(V[:, None], W[None]))
        dW = moves * _cross(W[:, None], W[None])
        linear = dV + _cross(dW, placed.p) + _cross(W[None], placed.J.T[:, None])
        return self._stacked(linear, dW, view.supports)

    def _gradient_rate(self, state: State) -> Array:
        """Time derivative of `_gradient` (n, rows, n)."""
        view = view_of(state)
        placed = view.frame(self.frame)
        rates = rates_of(state, self.frame, placed)
        V, W, aV, aW = state.J[:3].T, state.J[3:].T, state.dJ[:3].T, state.dJ[3:].T
        moves = self._moves(view.supports)[..., None]
        dW = moves * _cross(W[:, None], W[None])
        bV = moves * (_cross(aW[:, None], V[None]) + _cross(W[:, None], aV[None])
                      + _cross(aV[:, None], W[None]) + _cross(V[:, None], aW[None]))
        bW = moves * (_cross(aW[:, None], W[None]) + _cross(W[:, None], aW[None]))
        linear = (bV + _cross(bW, placed.p) + _cross(dW, rates.v)
                  + _cross(aW[None], placed.J.T[:, None])
                  + _cross(W[None], rates.dJ.T[:, None]))
        return self._stacked(linear, bW, view.supports)

    def _stacked(self, linear: Array, angular: Array, supports: NDArray[np.bool_]) -> Array:
        """Return (n, rows, n) of (n, n, 3), without the joints that do not move the frame."""
        both = linear if self.part == "position" else np.concatenate([linear, angular], axis=2)
        both = both * supports[self.frame.joint][None, :, None]
        return np.moveaxis(both, 2, 1)

    def _moves(self, supports: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Whether joint i moves the screw of joint k, and is not k itself: (n, n)."""
        n = supports.shape[1]
        if len(supports) != n + 1:
            raise HierarchyError(f"task {self.name!r}: a joint of the robot has several "
                                 "velocities, or the base floats")
        return supports[1:].T & ~np.eye(n, dtype=bool)


def _measure(J: Array) -> float:
    """The product of the singular values, which is more exact than a determinant."""
    return float(np.prod(np.linalg.svd(J, compute_uv=False)))


def _cross(a: Array, b: Array) -> Array:
    return np.cross(a, b)
