"""Look at a point: the z axis of a frame, such as a camera, toward a point of the world."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import check_parts
from hierarchy.tasks.geometric import Geometric, Placed, View, cross, rates_of, view_of

_NEAR = 1e-6    # [m] from the target, where no direction leads to it
_BEHIND = 1e-6  # 1 + u_z of a target straight behind, where every way round is as long
_ASIDE = np.array([1e-3, 0.0, -(1.0 - 1e-6) ** 0.5])


@dataclass(frozen=True)
class LookAt(Geometric):
    """Turn and move `frame` so that its z axis points at `target` (3,) [m] of the world (m = 2).

    With the unit vector u to the target in the frame's axes, the rows are 2 u_x / (1 + u_z) and
    2 u_y / (1 + u_z), of length 2 tan(angle / 2): the stereographic projection, which is regular on
    the axis, where the cosine of `Pointing` has no gradient, and everywhere but straight behind. At
    velocity level the angle falls by gain sin(angle).
    """

    frame: Frame
    target: tuple[float, float, float]
    stiffness: float = 20.0
    damping: float = 10.0
    gain: float = 5.0
    name: str = "look-at"
    point: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_parts(self)
        point = np.array(self.target, dtype=float)
        if point.shape != (3,) or not np.isfinite(point).all():
            raise HierarchyError(f"task {self.name!r}: target {list(self.target)} must be three "
                                 "finite numbers [m]")
        object.__setattr__(self, "point", point)

    @property
    def dimension(self) -> int:
        """Two rows."""
        return 2

    @property
    def row_names(self) -> tuple[str, ...]:
        """Axes of the frame."""
        return ("x", "y")

    def error(self, state: State) -> Array:
        """-2 (u_x, u_y) / (1 + u_z) (2,)."""
        u, _ = self._direction(view_of(state).frame(self.frame))
        return np.asarray(-2.0 * u[:2] / (1.0 + u[2]))

    def rows(self, view: View) -> Array:
        """P (1 - u u^T) / r  R^T (-J + [d]x W), at the distance r = |d|, P the projection's."""
        placed = view.frame(self.frame)
        u, r = self._direction(placed)
        return _projection(u) @ _across(u, r) @ self._seen(placed)

    def rows_derivative(self, state: State) -> Array:
        """The derivative of `rows`."""
        placed = view_of(state).frame(self.frame)
        rates = rates_of(state, self.frame, placed)
        (u, r), M = self._direction(placed), self._seen(placed)
        s = M @ state.v  # derivative of r u
        P, N = _projection(u), _across(u, r)
        du, dr = N @ s, float(u @ s)
        d = self.point - placed.p
        dM = placed.R.T @ (-rates.dJ + cross(-rates.v) @ placed.W + cross(d) @ rates.dW
                           - cross(rates.w) @ (-placed.J + cross(d) @ placed.W))
        dN = -(np.outer(du, u) + np.outer(u, du)) / r - N * (dr / r)
        return _projection_rate(u, du) @ N @ M + P @ (dN @ M + N @ dM)

    def _seen(self, placed: Placed) -> Array:
        """Jacobian (3, n) of the target in the frame's axes."""
        return placed.R.T @ (-placed.J + cross(self.point - placed.p) @ placed.W)

    def _direction(self, placed: Placed) -> tuple[Array, float]:
        """u (3,) and the distance [m] of the target, at least 1e-6 m; beside what is behind."""
        d = placed.R.T @ (self.point - placed.p)
        r = max(float(np.linalg.norm(d)), _NEAR)
        return (d / r, r) if d[2] > (_BEHIND - 1.0) * r else (_ASIDE, r)


def _projection(u: Array) -> Array:
    """Derivative (2, 3) of 2 (u_x, u_y) / (1 + u_z) by u."""
    c = 1.0 + u[2]
    return np.array([[2.0 / c, 0.0, -2.0 * u[0] / c**2], [0.0, 2.0 / c, -2.0 * u[1] / c**2]])


def _projection_rate(u: Array, du: Array) -> Array:
    """Time derivative (2, 3) of `_projection`."""
    c, dc = 1.0 + u[2], du[2]
    last = -2.0 * du[:2] / c**2 + 4.0 * u[:2] * dc / c**3
    return np.column_stack([-2.0 * dc / c**2 * np.eye(2), last])


def _across(u: Array, r: float) -> Array:
    """Derivative (3, 3) of the direction u by the vector r u."""
    return (np.eye(3) - np.outer(u, u)) / r
