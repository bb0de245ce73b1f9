"""DAQP's hierarchical call: inverse kinematics without a framework, and as a solver."""

from typing import Any

import daqp
import numpy as np
import pinocchio as pin

from benchmark.peers.scenes import Arm, Array, RefusedError
from benchmark.solve.interface import Answer, Solver
from hierarchy.problem import Hierarchy

_UNBOUNDED = 1e30  # how it writes a missing side


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


class Daqp(Solver):
    """`daqp.solve` with break points and settings; leading rows of the identity as bounds."""

    package = "daqp"

    def __init__(self, **settings: float) -> None:
        self.settings = settings

    def prepare(self, problem: Hierarchy) -> tuple[Any, ...]:
        """Convert, with a unit Hessian for the distance to the reference."""
        n = problem.n
        leading = len(problem.sizes) and problem.sizes[0] == n
        bounds = n if leading and (problem.A[:n] == np.eye(n)).all() else 0
        return (np.eye(n), -problem.reference, np.ascontiguousarray(problem.A[bounds:]),
                np.minimum(problem.upper, _UNBOUNDED), np.maximum(problem.lower, -_UNBOUNDED),
                np.zeros(problem.m, dtype=np.int32), problem.offsets[1:].astype(np.int32))

    def solve(self, prepared: tuple[Any, ...]) -> Any:
        """Call it."""
        return daqp.solve(*prepared, **self.settings)

    def read(self, raw: Any) -> Answer:
        """Return x, which is uninitialised unless the exit flag is positive."""
        x, _, flag, info = raw
        return Answer(np.array(x) if flag > 0 else np.zeros(len(x)), flag > 0,
                      int(info["iterations"]))
