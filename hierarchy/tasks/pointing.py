"""An axis of a frame: on a cone or inside it (eqs. 16-21), or toward a point of the world."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from math import cos
from typing import Annotated

import numpy as np

from hierarchy.errors import number
from hierarchy.gate import direction, readable
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import (
    Spot,
    carried,
    column,
    crossed,
    dot,
    jacobians_of,
    less,
    motion_of,
    place,
    rotation_of,
    row_times,
    times,
    turned,
    turned_back,
    velocity_of_body,
)
from hierarchy.measured import Measure, Measured, measured
from hierarchy.problem import Array
from hierarchy.records import Vector3, set_frozen
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Kind


@compiled
def _cone_error(placements, joint, z_e, z_d, cos_alpha_d):
    return cos_alpha_d - dot(z_d, turned(placements[joint], z_e))  # (16)


@measured
def _pointing(kinematics, reads, goal, J, motion):
    joint, z_e, z_d, cos_alpha_d = reads
    v, columns, dJ, placements, supports, _, _, _ = kinematics
    motion.error[0] = _cone_error(placements, joint, z_e, z_d, cos_alpha_d)
    z = turned(placements[joint], z_e)
    axis = crossed(z, z_d)
    for c in range(J.shape[1]):  # z_d . (w x z_e) = w . (z_e x z_d): z_d^T S^T(z_e) J_O, (19)
        if supports[joint, c]:
            J[0, c] = columns[3, c] * axis[0] + columns[4, c] * axis[1] + columns[5, c] * axis[2]
    _, w = velocity_of_body(columns, supports, joint, v)
    _, a = velocity_of_body(dJ, supports, joint, v)
    dz = crossed(w, z)  # (18)
    motion.rate[0] = dot(z_d, dz)
    motion.drift[0] = dot(z_d, carried(crossed(a, z), w, dz))


@dataclass(frozen=True)
class Pointing(Measured):
    """Keep the z axis of `frame` at the angle `half_angle` [rad] to `axis` (m = 1, p = z_d . z_e).

    With kind = "equality" the axis lies on the cone, cos(alpha) = cos(alpha_d), eq. (16). With
    kind = "inequality" it lies inside, cos(alpha_d) <= cos(alpha), eq. (21), as one row with a
    lower bound only. `axis` (3,) is z_d, normalised here. Gains as in `Task`.
    """

    frame: Frame
    axis: tuple[float, float, float]
    half_angle: Annotated[float, partial(number, least=0.0, largest=np.pi), "rad"]
    kind: Kind = "equality"
    stiffness: float = 5.0
    damping: float = 2.0
    gain: float = 5.0
    name: str = "pointing"
    dimension = 1
    z_d: Array = field(init=False, repr=False, compare=False)
    z_e: Array = field(init=False, repr=False, compare=False)
    cos_alpha_d: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        set_frozen(self, z_d=direction(f"task {self.name!r}: axis", self.axis),
                   cos_alpha_d=cos(self.half_angle),
                   z_e=np.ascontiguousarray(self.frame.rotation[:, 2]))

    def follow_cone_error(self, state: State) -> Callable[[], float]:
        """Return a function that gives the error at a state as it moves, for Algorithm 1.

        That is cos(alpha_d) - cos(alpha), positive outside the cone.
        """
        return bind(_cone_error, state.placements, self.frame.joint, self.z_e, self.z_d,
                    self.cos_alpha_d)

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`."""
        return _pointing, (self.frame.joint, self.z_e, self.z_d, self.cos_alpha_d)


_FAR = 1e100    # [m] at which a farther target stands, so that no square overflows
_NEAR = 1e-6    # [m] from the target, where no direction leads to it
_BEHIND = 1e-6  # 1 + u_z of a target straight behind, where every way round is as long
_ASIDE = (1e-3, 0.0, -(1.0 - 1e-6) ** 0.5)


@dataclass(frozen=True)
class LookAt(Measured):
    """Turn and move `frame` so that its z axis points at `target` (3,) [m] of the world (m = 2).

    With the unit vector u to the target in the frame's axes, the rows are 2 u_x / (1 + u_z) and
    2 u_y / (1 + u_z), of length 2 tan(angle / 2): the stereographic projection, which is regular on
    the axis, where the cosine of `Pointing` has no gradient, and everywhere but straight behind. At
    velocity level the angle falls by gain sin(angle). What is written into the array moves the
    target, without feedforward.
    """

    frame: Frame
    target: Annotated[Vector3, "m"]
    stiffness: float = 20.0
    damping: float = 10.0
    gain: float = 5.0
    name: str = "look-at"
    row_names = ("x", "y")

    def measure(self, state: State) -> Measure:
        """See `Measured.measure`: the error is -2 (u_x, u_y) / (1 + u_z)."""
        return _look_at, (Spot.of(self.frame), readable(self.name, self.target))


@measured
def _look_at(kinematics, reads, goal, J, motion):
    """The error is -2 y / D, D = r + y_z, and the target moves by R^T (-J + [d]x W) in the axes.

    y is the target in the frame's axes, r its distance, and d the vector to it in world axes.
    """
    frame, point = reads
    beyond = max(abs(point[0]), abs(point[1]), abs(point[2])) / _FAR
    d = less(times(1.0 / max(beyond, 1.0), point),
             place(kinematics.placements[frame.joint], frame.offset))
    R = rotation_of(kinematics.placements, frame)
    y = turned_back(R, d)
    r = max(np.sqrt(dot(y, y)), _NEAR)
    if not y[2] > (_BEHIND - 1.0) * r:
        y = times(r, _ASIDE)
    D = r + y[2]
    linear, angular = jacobians_of(kinematics, frame)
    for c in range(J.shape[1]):
        s = turned_back(R, less(crossed(d, column(angular, c)), column(linear, c)))
        dD = dot(y, s) / r + s[2]
        for i in range(2):
            J[i, c] = 2.0 * (s[i] - y[i] * dD / D) / D
    v, w, a, b = motion_of(kinematics, frame)
    seen = less(crossed(d, w), v)  # of the target, as it moves for the frame
    s = turned_back(R, seen)
    ds = turned_back(R, less(less(less(crossed(d, b), a), crossed(v, w)), crossed(w, seen)))
    dr = dot(y, s) / r
    dD, ddD = dr + s[2], (dot(s, s) + dot(y, ds) - dr * dr) / r + ds[2]
    for i in range(2):
        motion.error[i] = -2.0 * y[i] / D
        motion.rate[i] = row_times(J, i, kinematics.v)
        bend = 2.0 * s[i] * dD + y[i] * (ddD - 2.0 * dD * dD / D)
        motion.drift[i] = 2.0 * (ds[i] - bend / D) / D
