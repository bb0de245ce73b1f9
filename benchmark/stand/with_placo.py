"""placo's dynamics solver: contacts and limits hard, the tasks weighted, in one program."""

from __future__ import annotations

import numpy as np
import placo

from benchmark.arm.scene import RefusedError
from benchmark.stand.scene import Answer, Array, Gains, Stand

_BASE = 6  # velocities of the floating base


class Placo:
    """Planar contacts, a task for the centre of mass, each hand and the joints."""

    package = "placo"
    priorities = "2 levels, weights"

    def __init__(self, scene: Stand) -> None:
        self.scene = scene
        self.robot = robot = placo.RobotWrapper(scene.file, placo.Flags.ignore_collisions)
        self.to_theirs = [list(robot.joint_names()).index(name) for name in scene.joints]
        self._place(np.array(scene.rest), np.zeros(len(scene.rest) - 1))
        self.solver = solver = placo.DynamicsSolver(robot)
        solver.dt = scene.period
        solver.enable_joint_limits(False)
        solver.enable_velocity_limits(False)
        solver.enable_torque_limits(True)
        for name, limit in zip(scene.joints, scene.torque, strict=True):
            robot.set_torque_limit(name, limit)
        self.soles = [self._contact(sole) for sole in scene.soles]
        self.com = self._added(solver.add_com_task(np.zeros(3)), "com", scene.com)
        self.hands = [self._added(solver.add_position_task(hand, np.zeros(3)), hand, scene.hand)
                      for hand in scene.hands]
        self.joints = self._added(solver.add_joints_task(), "posture", scene.joint)
        self.joints.set_joints(dict(zip(scene.joints, scene.posture, strict=True)))

    def _contact(self, sole: str) -> placo.Contact6D:
        scene = self.scene
        task = self.solver.add_frame_task(sole, self.robot.get_T_world_frame(sole))
        task.configure(sole, "hard", 1.0, 1.0)
        for part in (task.position(), task.orientation()):
            part.kp, part.kd = scene.contact.stiffness, scene.contact.damping
        contact = self.solver.add_planar_contact(task)
        contact.length, contact.width = 2 * scene.half[0], 2 * scene.half[1]
        contact.mu = scene.friction
        contact.unilateral = True
        contact.weight_forces = scene.force**2
        contact.weight_moments = contact.weight_tangentials = scene.force**2
        return contact

    @staticmethod
    def _added(task: placo.DynamicsTask, name: str, gains: Gains) -> placo.DynamicsTask:
        task.configure(name, "soft", gains.weight**2)
        task.kp, task.kd = gains.stiffness, gains.damping
        return task

    def _place(self, q: Array, v: Array) -> None:
        state = self.robot.state
        state.q[:_BASE + 1], state.qd[:_BASE] = q[:_BASE + 1], v[:_BASE]
        state.q[_BASE + 1:][self.to_theirs] = q[_BASE + 1:]
        state.qd[_BASE:][self.to_theirs] = v[_BASE:]
        self.robot.update_kinematics()

    def tick(self, t: float, q: Array, v: Array, targets: Array) -> None:
        """See `Adapter`."""
        self._place(q, v)
        for task, (p, dp, ddp) in zip((self.com, *self.hands), targets, strict=True):
            task.target_world, task.dtarget_world, task.ddtarget_world = p, dp, ddp
        self.found = self.solver.solve(False)
        if not self.found.success:
            raise RefusedError("no success")

    def answer(self) -> Answer:
        """See `Adapter`."""
        a, torques = np.array(self.found.qdd), np.array(self.found.tau)
        wrenches = []
        for contact, sole in zip(self.soles, self.scene.soles, strict=True):
            R = self.robot.get_T_world_frame(sole)[:3, :3]
            w = np.array(contact.wrench)
            wrenches.append(np.concatenate([R @ w[:3], R @ w[3:]]))
        return Answer(np.concatenate([a[:_BASE], a[_BASE:][self.to_theirs]]),
                      torques[_BASE:][self.to_theirs], np.array(wrenches))
