"""A robot on a floor in MuJoCo, moved by joint torques."""

from __future__ import annotations

from collections import deque

import numpy as np

from hierarchy import Robot
from hierarchy.contacts import Contacts
from hierarchy.problem import Array
from scenarios.cell.plants.ground import Floor, on_floor
from scenarios.cell.plants.physics import mujoco_module
from scenarios.config import ScenarioError


class TorqueRobot:
    """A floating-base robot with torque motors, whose soles touch a floor with friction.

    `q` (nq,) and `v` (n,) are the true state in the robot's own convention [m, rad], from the
    start at `q`, `v` on moved by `act`, once per `period` [s]. `delay` is the number of periods by
    which torques arrive late; before the first they are zero. The floor's options are in `Floor`.

    Raises ScenarioError if mujoco is not installed, or the base of the robot is fixed.
    """

    def __init__(self, robot: Robot, contacts: Contacts, q: Array, v: Array | None = None,
                 period: float = 0.001, floor: Floor | None = None, delay: int = 0) -> None:
        if robot.base != "floating":
            raise ScenarioError(f"robot {robot.name!r}: a robot on a floor has a floating base")
        mujoco = mujoco_module()
        self.model = mujoco.MjModel.from_xml_string(
            on_floor(robot, contacts, floor or Floor(), period))
        self.data = mujoco.MjData(self.model)
        self._mujoco = mujoco
        self._soles = {contact.name: self.model.geom(contact.name).id
                       for contact in contacts.contacts if contact.is_surface}
        self.q, self.v = q.copy(), np.zeros(robot.n) if v is None else v.copy()
        self._waiting = deque(np.zeros((delay, robot.n - robot.actuated)))
        self.data.qpos[:] = q
        self.data.qpos[3:7] = q[[6, 3, 4, 5]]
        self.data.qvel[:] = self.v
        self.data.qvel[:3] = self._rotation() @ self.v[:3]
        mujoco.mj_forward(self.model, self.data)

    def act(self, torques: Array, push: tuple[str, Array] | None = None) -> None:
        """Apply torques (n - 6,) [N m], and a force (3,) [N] on a joint's body, for one period.

        The force acts at the body's centre of mass, in world axes; motors cut torques off at their
        limits.
        """
        self._waiting.append(np.array(torques))
        self.data.ctrl[:] = self._waiting.popleft()
        self.data.xfrc_applied[:] = 0.0
        if push is not None:
            self.data.body(f"body {push[0]}").xfrc_applied[:3] = push[1]
        self._mujoco.mj_step(self.model, self.data)
        self._read()

    def forces(self) -> dict[str, Array]:
        """Force (3,) [N] of the floor on each sole, world axes, in the last period."""
        wrench, found = np.zeros(6), {name: np.zeros(3) for name in self._soles}
        for i, contact in enumerate(self.data.contact):
            self._mujoco.mj_contactForce(self.model, self.data, i, wrench)
            force = contact.frame.reshape(3, 3).T @ wrench[:3]
            for name, geom in self._soles.items():
                if geom in (contact.geom1, contact.geom2):
                    found[name] += force if geom == contact.geom2 else -force
        return found

    def accelerations(self, torques: Array) -> Array:
        """Accelerations (n,) that torques cause at the present state, in the robot's convention."""
        self.data.ctrl[:] = torques
        self._mujoco.mj_forward(self.model, self.data)
        R, a = self._rotation(), np.array(self.data.qacc)
        a[:3] = R.T @ a[:3] - np.cross(self.v[3:6], self.v[:3])  # d(R^T p')/dt
        return a

    def _rotation(self) -> Array:
        R = np.zeros(9)
        self._mujoco.mju_quat2Mat(R, self.data.qpos[3:7])
        return R.reshape(3, 3)

    def _read(self) -> None:
        """Take over the state: a free joint of MuJoCo has w first, and a velocity in the world."""
        self.q[:] = self.data.qpos
        self.q[3:7] = self.data.qpos[[4, 5, 6, 3]]
        self.v[:] = self.data.qvel
        self.v[:3] = self._rotation().T @ self.data.qvel[:3]

