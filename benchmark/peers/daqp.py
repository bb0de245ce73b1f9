"""Inverse kinematics without a framework: pinocchio, numpy and DAQP's hierarchical call."""

from typing import Any

import daqp
import numpy as np
import pinocchio as pin

from benchmark.peers.scenes import Arm, Array, RefusedError


def arm(scene: Arm, posture: bool) -> tuple[Any, Any]:
    """Velocity limits as simple bounds, position and posture as levels of DAQP."""
    model = pin.buildModelFromUrdf(scene.file)
    data, frame, n = model.createData(), model.getFrameId(scene.frame), model.nv
    A = np.vstack([np.zeros((3, n)), np.eye(n)] if posture else [np.zeros((3, n))])
    upper = np.concatenate([scene.limit, np.zeros(len(A))])
    lower = -upper
    levels = np.array([n, n + 3, n + 3 + n][:3 if posture else 2], dtype=np.int32)
    asked = (np.eye(n), np.zeros(n), A, upper, lower, np.zeros(len(upper), dtype=np.int32), levels)

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        pin.computeJointJacobians(model, data, q)
        p = pin.updateFramePlacement(model, data, frame).translation
        A[:3] = pin.getFrameJacobian(model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)[:3]
        lower[n:n + 3] = upper[n:n + 3] = scene.wanted(p, goal, rate)
        if posture:
            lower[n + 3:] = upper[n + 3:] = scene.still(q)
        x, _, flag, _ = daqp.solve(*asked)
        if flag <= 0:
            raise RefusedError(f"exit flag {flag}")
        return np.asarray(x)

    return velocity, lambda: daqp.solve(*asked)
