"""tsid: inverse dynamics, so accelerations; here asked for those that make the velocity right.

With a gain of one over the period on velocities, and none on positions, v + period a is the
velocity asked for.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from tsid import tsid_pywrap as tsid  # 1.7.1 has an empty module above it

from benchmark.arm.scene import Array, RefusedError, Scene

_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


class Tsid:
    """Velocity bounds as constraints; position and posture weighted, or the position hard too."""

    package = "tsid"
    priorities = "weights"
    rows = "of its own kinds, hard"

    def __init__(self, scene: Scene, posture: bool, hard: bool = False) -> None:
        self.scene, self.hard = scene, hard
        self.robot = tsid.RobotWrapper(scene.file, [], False)
        n, period = self.robot.nv, scene.period
        self.formulation = tsid.InverseDynamicsFormulationAccForce("tsid", self.robot, False)
        self.formulation.computeProblemData(0.0, np.array(scene.start), np.zeros(n))
        self.bounds = bounds = tsid.TaskJointBounds("bounds", self.robot, period)
        bounds.setVelocityBounds(-np.array(scene.limit), np.array(scene.limit))
        self.formulation.addMotionTask(bounds, 1.0, 0, 0.0)  # stores no reference
        self.position = tsid.TaskSE3Equality("position", self.robot, scene.frame)
        self.position.setKp(np.zeros(6))
        self.position.setKd(np.full(6, 1.0 / period))
        self.position.setMask(np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
        self.position.useLocalFrame(False)
        self.formulation.addMotionTask(self.position, scene.ratio**2, 0 if hard else 1, 0.0)
        self.joints = tsid.TaskJointPosture("posture", self.robot)
        self.joints.setKp(np.zeros(n))
        self.joints.setKd(np.full(n, 1.0 / period))
        if posture:
            self.formulation.addMotionTask(self.joints, 1.0, 1, 0.0)
        self.posture = np.array(scene.posture)
        self.wanted, self.rates = tsid.TrajectorySample(12, 6), tsid.TrajectorySample(n)
        self.wanted.value(np.append(np.zeros(3), np.eye(3)))  # has no weight, but must be a pose
        self.solver = tsid.SolverHQuadProgFast("solver")
        self.sized = False

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """See `Adapter`."""
        scene, formulation, robot = self.scene, self.formulation, self.robot
        # The position is needed before computeProblemData, which computes it as well.
        data = formulation.data()
        pin.framesForwardKinematics(robot.model(), data, q)
        p = data.oMf[self.position.frame_id].translation
        self.wanted.derivative(np.append(rate + scene.gain * (goal - p), np.zeros(3)))
        self.position.setReference(self.wanted)
        self.rates.derivative(scene.posture_gain * (self.posture - q))
        self.joints.setReference(self.rates)
        self.problem = formulation.computeProblemData(t, q, v)
        if not self.sized:
            self.solver.resize(formulation.nVar, formulation.nEq, formulation.nIn)
            self.sized = True
        found = self.resolve()
        if found.status != 0:
            raise RefusedError(f"status {found.status}")
        return np.asarray(v + scene.period * formulation.getAccelerations(found))

    def resolve(self) -> tsid.HQPOutput:
        """See `Adapter`."""
        return self.solver.solve(self.problem)


class TsidHard(Tsid):
    """The position as a constraint."""

    priorities = "one hard, then weights"

    def __init__(self, scene: Scene, posture: bool) -> None:
        super().__init__(scene, posture, hard=True)
