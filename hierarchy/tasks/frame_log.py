"""Pose of a frame by the logarithm of SE(3) (m = 6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from hierarchy.state import State
from hierarchy.tasks.geometric import View, cross, rates_of, view_of
from hierarchy.tasks.pose import PoseTask, rotation_vector

_SERIES = 0.01   # [rad^2] squared angle below which coefficients are taken from their series
_STEP = 1e-30    # of a complex step: no difference is formed, so it may be this small


@dataclass(frozen=True)
class FrameLog(PoseTask):
    """Move `frame` along `path` with the constant orientation `rotation` (3, 3) (m = 6) [m, rad].

    The error is e = log(T^-1 T_d), with the poses T of the frame and T_d of its target: the twist
    in the axes of the frame, linear part first, that takes it to the target in unit time. The frame
    moves on a screw, where with `Pose` its origin moves on a straight line. It is what `FrameTask`
    of pink and of placo are. Beyond half a turn the error jumps.

    Source: F. Bullo, R. Murray, "Proportional derivative (PD) control on the Euclidean group",
    European Control Conference (1995).
    """

    name: str = "frame"
    row_names = ("x", "y", "z", "about x", "about y", "about z")

    def error(self, state: State) -> Array:
        """The twist e (6,) [m, rad]."""
        return self._error(view_of(state), state.t)

    def jacobian(self, state: State) -> Array:
        """J = D(e) J_b (6, n), with the Jacobian J_b of the frame in its own axes."""
        return self._jacobian(view_of(state), state.t)

    def jacobian_derivative(self, state: State) -> Array:
        """D(e) dJ_b + D'(e) J_b, with the motion of the target in de/dt: (6, n)."""
        if state.period > 0.0:
            return self._difference(state)
        placed = view_of(state).frame(self.frame)
        rates = rates_of(state, self.frame, placed)
        turning = cross(rates.w)
        J_b = np.vstack([placed.R.T @ placed.J, placed.R.T @ placed.W])
        dJ_b = np.vstack([placed.R.T @ (rates.dJ - turning @ placed.J),
                          placed.R.T @ (rates.dW - turning @ placed.W)])
        e = self.error(state)
        return np.asarray(_left(e) @ dJ_b + _along(_left, e, self._rate(state)) @ J_b)

    def desired_velocity(self, state: State) -> Array:
        """The part of de/dt that comes from the path: D(-e) V_d (6,), V_d in the target's axes."""
        return np.asarray(_left(-self.error(state)) @ self._twist(state.t, 1))

    def desired_acceleration(self, state: State) -> Array:
        """Its time derivative (6,)."""
        e, rate = self.error(state), self._rate(state)
        return np.asarray(_left(-e) @ self._twist(state.t, 2)
                          + _along(_left, -e, -rate) @ self._twist(state.t, 1))

    def _error(self, view: View, t: float) -> Array:
        placed = view.frame(self.frame)
        away = placed.R.T @ (self.path(t)[0] - placed.p)
        turn = rotation_vector(placed.R.T @ np.asarray(self.rotation, dtype=float))
        K = cross(turn)
        return np.concatenate([away - K @ away / 2 + _of_angle(turn @ turn)[0] * (K @ K @ away),
                               turn])

    def _jacobian(self, view: View, t: float) -> Array:
        placed = view.frame(self.frame)
        J_b = np.vstack([placed.R.T @ placed.J, placed.R.T @ placed.W])
        return np.asarray(_left(self._error(view, t)) @ J_b)

    def _difference(self, state: State) -> Array:
        before = View(state.previous_J, state.previous_placements, state.supports)
        return (self.jacobian(state)
                - self._jacobian(before, state.t - state.period)) / state.period

    def _rate(self, state: State) -> Array:
        """de/dt (6,)."""
        return self.desired_velocity(state) - self.jacobian(state) @ state.v

    def _twist(self, t: float, order: int) -> Array:
        """Velocity or acceleration of the target in its own axes (6,)."""
        R = np.asarray(self.rotation, dtype=float)
        return np.concatenate([R.T @ self.path(t)[order], np.zeros(3)])


def _left(e: NDArray[Any]) -> NDArray[Any]:
    """D(e) (6, 6): de/dt = -D(e) V for a frame that moves with the twist V in its own axes.

    It is the inverse of the left Jacobian of SE(3) at e: I - ad / 2 + A ad^2 + B ad^4.
    """
    linear, angular = cross(e[:3]), cross(e[3:])
    ad = np.block([[angular, linear], [np.zeros((3, 3)), angular]])
    _, A, B = _of_angle(e[3:] @ e[3:])
    square = ad @ ad
    return np.asarray(np.eye(6) - ad / 2 + A * square + B * square @ square)


def _of_angle(square: Any) -> tuple[Any, Any, Any]:
    """Coefficients of SO(3), and A and B of SE(3), at a squared angle [rad^2]."""
    if square.real < _SERIES:
        return (1 / 12 + square / 720 + square**2 / 30240 + square**3 / 1209600,
                1 / 12 - square**2 / 30240 - square**3 / 604800,
                -1 / 720 - square / 15120 - square**2 / 403200)
    half = np.sqrt(square) / 2
    alpha, beta = half / np.tan(half), (half / np.sin(half))**2
    return ((1 - alpha) / square, (2 * (1 - alpha) + (alpha - beta) / 2) / square,
            (1 - alpha + (alpha - beta) / 2) / square**2)


def _along(function: Any, e: Array, rate: Array) -> Array:
    """The derivative of a function of e along `rate`, by a complex step: exact to rounding."""
    return np.asarray(function(e + 1j * _STEP * rate).imag / _STEP)
