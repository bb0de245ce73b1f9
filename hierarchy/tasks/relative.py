"""Pose of a frame in another frame: two hands that hold one thing, a loop that is closed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import check_parts
from hierarchy.tasks.geometric import Geometric, View, cross, rates_of, view_of
from hierarchy.tasks.pose import rotation_vector


@dataclass(frozen=True)
class RelativePose(Geometric):
    """Keep `frame` at `position` (3,) [m] and `rotation` (3, 3) in the axes of the frame `to`.

    m = 6, or 3 with `rotation` None: then only the position counts. The orientation error is the
    rotation vector from the actual to the desired orientation, in the axes of `to`.
    """

    frame: Frame
    to: Frame
    position: ArrayLike
    rotation: ArrayLike | None = None
    stiffness: float = 40.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "relative"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_parts(self)
        if isinstance(self.to, str):
            raise HierarchyError(f"task {self.name!r}: to is the name {self.to!r}; give "
                                 f"robot.frame({self.to!r})")

    @property
    def dimension(self) -> int:
        """Six rows, or three without orientation."""
        return 3 if self.rotation is None else 6

    @property
    def row_names(self) -> tuple[str, ...]:
        """Axes of `to`."""
        return ("x", "y", "z", "about x", "about y", "about z")[:self.dimension]

    def error(self, state: State) -> Array:
        """Desired minus actual position [m], then the rotation vector [rad]: (m,)."""
        there, here = view_of(state).frame(self.frame), view_of(state).frame(self.to)
        missed = np.asarray(self.position, dtype=float) - here.R.T @ (there.p - here.p)
        if self.rotation is None:
            return np.asarray(missed)
        turn = np.asarray(self.rotation, dtype=float) @ (here.R.T @ there.R).T
        return np.concatenate([missed, rotation_vector(turn)])

    def rows(self, view: View) -> Array:
        """R^T (J_f - J_t + [d]x W_t) and R^T (W_f - W_t), of frame f and frame t, d = p_f - p_t."""
        R, linear, angular = self._parts(view)
        return np.vstack([R.T @ linear, R.T @ angular])[:self.dimension]

    def rows_derivative(self, state: State) -> Array:
        """The derivative of `rows`, with dR/dt = [w]x R."""
        view = view_of(state)
        there, here = view.frame(self.frame), view.frame(self.to)
        of, to = rates_of(state, self.frame, there), rates_of(state, self.to, here)
        R, linear, angular = self._parts(view)
        turning = cross(to.w)
        dlinear = (of.dJ - to.dJ + cross(of.v - to.v) @ here.W
                   + cross(there.p - here.p) @ to.dW - turning @ linear)
        return np.vstack([R.T @ dlinear,
                          R.T @ (of.dW - to.dW - turning @ angular)])[:self.dimension]

    def _parts(self, view: View) -> tuple[Array, Array, Array]:
        """R of `to`, and linear and angular Jacobian (3, n) relative to it, in world axes."""
        there, here = view.frame(self.frame), view.frame(self.to)
        linear = there.J - here.J + cross(there.p - here.p) @ here.W
        return here.R, linear, there.W - here.W
