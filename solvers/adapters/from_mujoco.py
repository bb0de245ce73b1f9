"""Levels for velocity control from a MuJoCo model and its data (extra `sim`).

The unknown is the velocity (nv,), in MuJoCo's order. The data must be up to date for its qpos: call
`mj_forward`, or `mj_kinematics` and `mj_comPos`. Each `_level` function returns a level for
`Hierarchy.from_levels`: `(A, b)` or `(A, lower, upper)`. It raises a HierarchyError, naming the
argument, for a gain below zero, a target or a velocity of another shape or that is not finite, and
for a rotation that is none.
"""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, check_name, finite_numbers, number, positive, refuse
from hierarchy.gate import array_of, check_rotation
from hierarchy.problem import Array

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

KINDS = ("body", "site", "geom")


def frame(model: MjModel, data: MjData, name: str, kind: str = "body") -> tuple[Array, Array]:
    """Return the position (3,) [m] and rotation (3, 3) of a body, site or geom in the world."""
    at = getattr(data, kind)(_index(model, name, kind))  # of a body not `xipos`, its centre of mass
    return np.array(at.xpos), np.array(at.xmat).reshape(3, 3)


def jacobian(model: MjModel, data: MjData, name: str, kind: str = "body") -> Array:
    """Return the Jacobian (6, nv) of a frame: velocity of its origin, then angular velocity.

    Both are in world axes.
    """
    import mujoco

    J, which = np.zeros((6, model.nv)), _index(model, name, kind)
    getattr(mujoco, f"mj_jac{kind.title()}")(model, data, J[:3], J[3:], which)
    return J


def position_level(model: MjModel, data: MjData, name: str, target: ArrayLike, gain: float,
                   kind: str = "body", velocity: ArrayLike = (0.0, 0.0, 0.0)
                   ) -> tuple[Array, Array]:
    """Move the origin of a frame to `target` (3,) [m]: J x = velocity + gain (target - position).

    gain [1/s]; `velocity` (3,) [m/s] of the target.
    """
    position, _ = frame(model, data, name, kind)
    return (jacobian(model, data, name, kind)[:3],
            finite_numbers("velocity [m/s]", velocity, 3)
            + _gain(gain) * (finite_numbers("target [m]", target, 3) - position))


def orientation_level(model: MjModel, data: MjData, name: str, target: ArrayLike, gain: float,
                      kind: str = "body") -> tuple[Array, Array]:
    """Turn a frame to the rotation `target` (3, 3): angular velocity = gain times the error.

    The error is the rotation vector [rad] to the target, in world axes; gain [1/s].
    """
    import mujoco

    _, rotation = frame(model, data, name, kind)
    check_rotation("target", target)
    error = np.array(target, dtype=float) @ rotation.T
    quaternion, vector = np.empty(4), np.empty(3)
    mujoco.mju_mat2Quat(quaternion, error.ravel())
    mujoco.mju_quat2Vel(vector, quaternion, 1.0)
    return jacobian(model, data, name, kind)[3:], _gain(gain) * vector


def posture_level(model: MjModel, data: MjData, target: ArrayLike, gain: float
                  ) -> tuple[Array, Array]:
    """Move all joints to `target` (nq,) [rad or m]: x = gain times the difference; gain [1/s]."""
    import mujoco

    difference = np.empty(model.nv)
    mujoco.mj_differentiatePos(model, difference, 1.0, data.qpos,
                               finite_numbers("target", target, model.nq))
    return np.eye(model.nv), _gain(gain) * difference


def limit_level(model: MjModel, data: MjData, period: float, velocity: float | ArrayLike = np.inf
                ) -> tuple[Array, Array, Array]:
    """Keep hinges and slides within their ranges after the next `period` [s], and `velocity`.

    velocity [rad/s or m/s] : one number or (nv,). A joint outside its range returns as fast as the
        velocity allows.

    Raises HierarchyError for a period or velocity that is not positive, and for a limited joint
    that is neither a hinge nor a slide.
    """
    import mujoco

    period, given = positive("limits: period [s]", period), array_of("limits: velocity", velocity)
    refuse(given.shape not in ((), (model.nv,)) or not (given > 0.0).all(), "limits: velocity "
           f"{velocity!r}: expected a number > 0, or {model.nv} of them")
    fastest = np.broadcast_to(given, model.nv)
    single = (int(mujoco.mjtJoint.mjJNT_HINGE), int(mujoco.mjtJoint.mjJNT_SLIDE))
    lower, upper = -fastest, fastest.copy()
    for joint in range(model.njnt):
        if not model.jnt_limited[joint]:
            continue
        if model.jnt_type[joint] not in single:
            raise HierarchyError(f"limits: joint {model.joint(joint).name!r} is neither a hinge "
                                 "nor a slide; its range cannot become a bound")
        i, q = model.jnt_dofadr[joint], data.qpos[model.jnt_qposadr[joint]]
        lower[i], upper[i] = np.clip((model.jnt_range[joint] - q) / period, lower[i], upper[i])
    return np.eye(model.nv), lower, upper


def _index(model: MjModel, name: str, kind: str) -> int:
    check_name("kind of frame", kind, KINDS)
    named = getattr(model, kind)
    with suppress(KeyError, TypeError):
        return int(named(name).id)
    names = [named(i).name for i in range(getattr(model, f"n{kind}"))]
    check_name(kind, name, [known for known in names if known])
    return names.index(name)


def _gain(value: float) -> float:
    return number("gain [1/s]", value, 0.0)
