"""tsid: physics, contacts, friction and torque limits hard; the tasks weighted below."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from tsid import tsid_pywrap as tsid  # 1.7.1 has an empty module above it

from benchmark.arm.scene import RefusedError
from benchmark.stand.scene import Answer, Array, Gains, Stand, wrench

_LARGEST = 1e4  # [N] of a contact; must be given


class Tsid:
    """Two levels. Tasks and contacts are kept as attributes: it holds no references of its own."""

    package = "tsid"
    priorities = "2 levels, weights"

    def __init__(self, scene: Stand, solver: str) -> None:
        self.scene = scene
        self.robot = robot = tsid.RobotWrapper(scene.file, [], pin.JointModelFreeFlyer(), False)
        if tuple(robot.model().names)[2:] != scene.joints:
            raise RefusedError("its joints are in another order")
        self.formulation = tsid.InverseDynamicsFormulationAccForce("tsid", robot, False)
        self.formulation.computeProblemData(0.0, np.array(scene.rest), np.zeros(robot.nv))
        self.soles = [self._contact(sole) for sole in scene.soles]
        self.limits = tsid.TaskActuationBounds("limits", robot)
        self.limits.setBounds(-np.array(scene.torque), np.array(scene.torque))
        self.formulation.addActuationTask(self.limits, 1.0, 0, 0.0)
        self.tasks = [self._added(tsid.TaskComEquality("com", robot), scene.com, 3),
                      *(self._hand(hand) for hand in scene.hands)]
        self.samples = [tsid.TrajectorySample(3), *(tsid.TrajectorySample(12, 6) for _ in "lr")]
        self.joints = self._added(tsid.TaskJointPosture("posture", robot), scene.joint,
                                  len(scene.joints))
        self.rest = tsid.TrajectorySample(len(scene.joints))
        self.rest.value(np.array(scene.posture))
        self.joints.setReference(self.rest)
        self.solver = getattr(tsid, solver)("solver")
        formulation = self.formulation
        self.solver.resize(formulation.nVar, formulation.nEq, formulation.nIn)

    def _contact(self, sole: str) -> tsid.Contact6d:
        scene, robot = self.scene, self.robot
        contact = tsid.Contact6d(sole, robot, sole, np.ascontiguousarray(scene.corners.T),
                                 np.array([0.0, 0.0, 1.0]), scene.friction, 0.0, _LARGEST)
        contact.setKp(np.full(6, scene.contact.stiffness))
        contact.setKd(np.full(6, scene.contact.damping))
        frame = robot.model().getFrameId(sole)
        contact.setReference(robot.framePosition(self.formulation.data(), frame))
        self.formulation.addRigidContact(contact, scene.force**2, 1.0, 0)
        return contact

    def _added(self, task: tsid.TaskJointPosture, gains: Gains, rows: int) -> tsid.TaskJointPosture:
        task.setKp(np.full(rows, gains.stiffness))
        task.setKd(np.full(rows, gains.damping))
        self.formulation.addMotionTask(task, gains.weight**2, 1, 0.0)
        return task

    def _hand(self, frame: str) -> tsid.TaskSE3Equality:
        task = tsid.TaskSE3Equality(frame, self.robot, frame)
        task.setMask(np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
        task.useLocalFrame(False)
        return self._added(task, self.scene.hand, 6)

    def tick(self, t: float, q: Array, v: Array, targets: Array) -> None:
        """See `Adapter`."""
        com, *hands = self.samples
        p, dp, ddp = targets[0]
        com.value(p)
        com.derivative(dp)
        com.second_derivative(ddp)
        self.tasks[0].setReference(com)
        for task, sample, (p, dp, ddp) in zip(self.tasks[1:], hands, targets[1:], strict=True):
            sample.value(np.concatenate((p, _UNTURNED)))
            sample.derivative(np.concatenate((dp, _STILL)))
            sample.second_derivative(np.concatenate((ddp, _STILL)))
            task.setReference(sample)
        self.problem = self.formulation.computeProblemData(t, q, v)
        found = self.resolve()
        if found.status != 0:
            raise RefusedError(f"status {found.status}")
        self.found = found
        self.torques = self.formulation.getActuatorForces(found)
        self.a = self.formulation.getAccelerations(found)

    def answer(self) -> Answer:
        """See `Adapter`."""
        wrenches = []
        for sole in self.scene.soles:
            frame = self.robot.model().getFrameId(sole)
            R = self.robot.framePosition(self.formulation.data(), frame).rotation
            forces = np.array(self.formulation.getContactForce(sole, self.found)).reshape(4, 3)
            wrenches.append(wrench(R, self.scene.corners, forces))
        return Answer(np.array(self.a), np.array(self.torques), np.array(wrenches))

    def resolve(self) -> tsid.HQPOutput:
        """See `Adapter`."""
        return self.solver.solve(self.problem)


_UNTURNED, _STILL = np.eye(3).ravel(), np.zeros(3)  # orientation has no weight
