"""Inverse kinematics without a framework: pinocchio, numpy and DAQP's hierarchical call."""

from __future__ import annotations

import daqp
import numpy as np
import pinocchio as pin

from benchmark.arm.scene import Array, RefusedError, Scene

_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Daqp:
    """Velocity limits as simple bounds, position and posture as levels of DAQP."""

    package = "daqp"
    priorities = "strict, softened"
    rows = "any, in any level"

    def __init__(self, scene: Scene, posture: bool) -> None:
        self.scene = scene
        self.model = pin.buildModelFromUrdf(scene.file)
        self.data, self.frame = self.model.createData(), self.model.getFrameId(scene.frame)
        n = self.model.nv
        self.A = np.vstack([np.zeros((3, n)), np.eye(n)] if posture else [np.zeros((3, n))])
        self.upper = np.concatenate([scene.limit, np.zeros(len(self.A))])
        self.lower, self.posture = -self.upper, np.array(scene.posture) if posture else None
        levels = [n, n + 3, n + 3 + n][:3 if posture else 2]
        self.fixed = (np.eye(n), np.zeros(n))
        self.kinds = np.zeros(len(self.upper), dtype=np.int32)
        self.levels = np.array(levels, dtype=np.int32)

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """See `Adapter`."""
        n, scene = self.model.nv, self.scene
        pin.computeJointJacobians(self.model, self.data, q)
        p = pin.updateFramePlacement(self.model, self.data, self.frame).translation
        self.A[:3] = pin.getFrameJacobian(self.model, self.data, self.frame, _AXES)[:3]
        self.lower[n:n + 3] = self.upper[n:n + 3] = rate + scene.gain * (goal - p)
        if self.posture is not None:
            self.lower[n + 3:] = self.upper[n + 3:] = scene.posture_gain * (self.posture - q)
        x, _, flag, _ = self.resolve()
        if flag <= 0:
            raise RefusedError(f"exit flag {flag}")
        return np.asarray(x)

    def resolve(self) -> tuple[Array, float, int, dict[str, float]]:
        """See `Adapter`."""
        found: tuple[Array, float, int, dict[str, float]] = daqp.solve(
            *self.fixed, self.A, self.upper, self.lower, self.kinds, self.levels)
        return found
