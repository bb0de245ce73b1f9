"""A robot on a floor in MuJoCo, moved by joint torques, and how its contacts touch the floor."""

from collections import deque
from collections.abc import Mapping
from math import acos, ceil, cos, exp, pi, sin
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hierarchy import Robot, State
from hierarchy.contacts import Contacts
from hierarchy.errors import naming
from hierarchy.problem import Array
from hierarchy.tasks.joints.mechanism import Mechanism
from scenarios.cell.plants.mjcf import LEAST, Stops, on_floor
from scenarios.cell.plants.physics import mujoco_module
from scenarios.cell.plants.plant import whole_periods
from scenarios.config import ScenarioError
from scenarios.config.sections.plant import TorqueSection

_STEP = 0.001      # [s] of the simulation, at most
_ROUNDING = 1e-9   # of a number of steps
_LOADED = 1.0      # [N] of normal force from which a contact carries
_CORNERS = np.array([(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1)])  # of a box, its bottom


class TorqueRobot:
    """A robot with torque motors, whose contacts touch a floor with friction.

    `q` (nq,) and `v` (n,) are the true state in the robot's own convention [m, rad], `a` (n,) its
    mean acceleration over the last period, from the start at `q`, `v` on moved by `act`, once per
    `period` [s]. Until the first torques arrive, if they are late, the motors carry the gravity of
    the start. `fault` says why the robot cannot go on, or is None. `extra` has, of the last step of
    the simulation, `com` (3,) [m], `push` (3,) [N], and of each contact `floor_force` (C, 3) [N] in
    world axes, `slip` (C,) [m] and `pressure_margin` (C,) [m]; and `support_margin` () [m], see
    `Touch`.

    Raises ScenarioError if mujoco is not installed or refuses the robot, a joint has several axes,
    a push is on an unknown joint, or the delay is not a whole number of periods.
    """

    def __init__(self, robot: Robot, contacts: Contacts, q: Array, v: Array | None = None,
                 period: float = 0.001, section: TorqueSection | None = None) -> None:
        self._mujoco = mujoco = mujoco_module()
        self._section = section = section or TorqueSection(kind="torque")
        self._period, self._steps = period, ceil(period / _STEP - _ROUNDING)
        scene = on_floor(robot, contacts, section, period / self._steps, q)
        with naming(f"plant: MuJoCo refuses robot {robot.name!r}", ScenarioError, ValueError):
            self.model = mujoco.MjModel.from_xml_string(scene)
        self.data = mujoco.MjData(self.model)
        self._floating = robot.base == "floating"
        self.q, self.v = q.copy(), np.zeros(robot.n) if v is None else v.copy()
        self.a = np.zeros(robot.n)
        self._parts = [part for part in robot.parts if part.v >= robot.actuated]
        self._robot, self._mechanism = robot, Mechanism(robot)
        joints = [self.model.joint(name) for name in robot.joint_names[int(self._floating):]]
        self._places = [int(joint.qposadr[0]) for joint in joints]
        self._rates = [*range(robot.actuated), *(int(joint.dofadr[0]) for joint in joints)]
        self._drives = self.model.dof_armature[self._rates] - robot.model.armature + LEAST[1]
        self._write()
        mujoco.mj_forward(self.model, self.data)
        delay = whole_periods(section.delay, period, "plant.delay")
        # The share by which a motor's torque nears the one asked for in a step of the simulation.
        self._share = 1.0 if section.bandwidth is None else 1.0 - exp(
            -2.0 * pi * section.bandwidth * period / self._steps)
        self.data.ctrl[:] = State.at(robot, q).bias_effort()[robot.actuated:]
        self._waiting = deque([np.array(self.data.ctrl)] * delay)
        with naming("plant.pushes", ScenarioError):
            for push in section.pushes:
                robot.joint(push.joint)
        self._pushes = [(push, self.model.body(f"body {push.joint}").id, push.vector)
                        for push in section.pushes]
        self._time, self._height = 0.0, float(self.data.subtree_com[0][2])
        self._stops = Stops(robot, q, section.beyond_stop)
        self._upright = self._rotation()[2] if self._floating else np.zeros(3)
        self._touch = Touch(mujoco, self.model, contacts)
        self._push = np.zeros(3)
        self._com = np.array(self.data.subtree_com[0])
        self.extra: Mapping[str, NDArray[Any]] = {
            "com": self._com, "push": self._push, **self._touch.signals}
        self._touch.look(self.data)

    def act(self, command: Array) -> None:
        """Apply torques (n,), those of the actuated joints [N m], for one period.

        Motors cut them off at their limits.
        """
        self._waiting.append(np.array(command))
        torques = self._waiting.popleft()
        before = self.v.copy()
        self.data.xfrc_applied[:] = 0.0
        self._push[:] = 0.0
        for push, body, force in self._pushes:
            if push.acts(self._time):
                self.data.xfrc_applied[body, :3] += force
                self._push += force
        for _ in range(self._steps):
            self.data.ctrl[:] = (1.0 - self._share) * self.data.ctrl + self._share * torques
            self._mujoco.mj_step(self.model, self.data)
        self._time += self._period
        self._read()
        if self._mechanism:  # MuJoCo keeps it to some 1e-6
            self.q[:] = self._mechanism.closed(self.q)
            self.v[:] = self._mechanism.moving(self.q, self.v, self._drives)
            self._write()
        self.a[:] = (self.v - before) / self._period
        self._com[:] = self.data.subtree_com[0]
        self._touch.look(self.data)

    @property
    def fault(self) -> str | None:
        """Why the robot cannot go on: it has fallen, or a joint has passed its stop; or None."""
        if self._floating:
            fallen = self._height - float(self._com[2])
            if fallen > self._section.fall:
                return f"the robot has fallen by {fallen:.2g} m"
            tilt = acos(float(np.clip(self._rotation()[2] @ self._upright, -1.0, 1.0)))
            if tilt > self._section.tilt:
                return (f"the robot has fallen: its base has tilted by {tilt:.2g} rad "
                        f"(plant.tilt = {self._section.tilt:g}),")
        return self._stops.passed(self.q)

    def _rotation(self) -> Array:
        """Return the rotation (3, 3) of a floating base, whose last row is the vertical in it."""
        R = np.zeros(9)
        self._mujoco.mju_quat2Mat(R, self.data.qpos[3:7])
        return R.reshape(3, 3)

    def _write(self) -> None:
        """Give MuJoCo the state: its free joint has w first, and a velocity in the world.

        It counts the turns of continuous joints, which stay as they are.
        """
        values = self._robot.vector(self.q)[self._robot.actuated:]
        turns = np.round((self.data.qpos[self._places] - values) / (2.0 * pi))
        turning = np.array([part.size == 2 for part in self._parts], dtype=bool)
        self.data.qpos[self._places] = values + 2.0 * pi * turns * turning
        self.data.qvel[self._rates] = self.v
        if self._floating:
            self.data.qpos[:7] = self.q[[0, 1, 2, 6, 3, 4, 5]]
            self.data.qvel[:3] = self._rotation() @ self.v[:3]

    def _read(self) -> None:
        """Take the state from MuJoCo."""
        for part, x in zip(self._parts, self.data.qpos[self._places].tolist(), strict=True):
            self.q[part.q:part.q + part.size] = x if part.size == 1 else (cos(x), sin(x))
        self.v[:] = self.data.qvel[self._rates]
        if self._floating:
            self.q[:7] = self.data.qpos[[0, 1, 2, 4, 5, 6, 3]]
            self.v[:3] = self._rotation().T @ self.data.qvel[:3]


@final
class Touch:
    """Reads what the floor does to each of C contacts, in their order, after a step.

    `force` (C, 3) [N] in world axes; `slip` (C,) [m], how far a contact has moved along the floor
    since it touched down, NaN if it is to slide; `margin` (C,) [m], of the centre of pressure from
    the nearest edge of the sole, NaN for a point or without force; `balance` () [m], how far inside
    the support polygon, the hull of all points of the loaded contacts, the centre of mass is from
    above, NaN below three such points, or if they are on a line.
    `signals` has these arrays by the names of signals.
    """

    def __init__(self, mujoco: Any, model: Any, contacts: Contacts) -> None:
        self._force_of, self._model = mujoco.mj_contactForce, model
        self._geoms = [model.geom(f"contact {name}").id for name in contacts.names]
        self._sole = [contact.is_surface for contact in contacts.contacts]
        self._slides = [contact.slides for contact in contacts.contacts]
        self._of_geom = {geom: c for c, geom in enumerate(self._geoms)}
        count = len(self._geoms)
        self.force, self.slip = np.zeros((count, 3)), np.zeros(count)
        self.margin, self.balance = np.full(count, np.nan), np.full((), np.nan)
        self.signals: dict[str, NDArray[Any]] = {
            "floor_force": self.force, "slip": self.slip, "pressure_margin": self.margin,
            "support_margin": self.balance}
        self._wrench, self._moment = np.zeros(6), np.zeros((count, 3))
        self._anchor: list[Array | None] = [None] * count
        self._points = [_CORNERS * model.geom_size[geom] if sole else np.zeros((1, 3))
                        for geom, sole in zip(self._geoms, self._sole, strict=True)]

    def look(self, data: Any) -> None:
        """Read the contacts of the step just made."""
        self.force[:], self._moment[:] = 0.0, 0.0  # moment: sum of normal force times place
        for i in range(data.ncon):
            contact = data.contact[i]
            first = self._of_geom.get(contact.geom1)
            c = self._of_geom.get(contact.geom2) if first is None else first
            if c is None:  # two links of the robot
                continue
            self._force_of(self._model, data, i, self._wrench)
            force = contact.frame.reshape(3, 3).T @ self._wrench[:3]
            self.force[c] += force if first is None else -force
            self._moment[c] += self._wrench[0] * contact.pos
        loaded = [np.empty((0, 3))]  # points of the contacts that carry
        for c, geom in enumerate(self._geoms):
            place, axes = data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3)
            self._note(c, place, axes)
            if self.force[c, 2] > _LOADED:
                loaded.append(place + self._points[c] @ axes.T)
        self.balance[...] = inside(np.concatenate(loaded)[:, :2], data.subtree_com[0][:2])

    def _note(self, c: int, place: Array, axes: Array) -> None:
        """Note slip and margin of a contact whose geometry is at `place`, with these axes."""
        load = self.force[c, 2]
        if load <= 0.0:
            self.slip[c], self.margin[c], self._anchor[c] = 0.0, np.nan, None
            return
        anchor = self._anchor[c]
        if anchor is None:
            self._anchor[c] = anchor = place[:2].copy()
        moved = place[:2] - anchor
        self.slip[c] = np.nan if self._slides[c] else np.sqrt(moved @ moved)
        if self._sole[c]:
            pressure = axes.T @ (self._moment[c] / load - place)
            half = self._model.geom_size[self._geoms[c]]
            self.margin[c] = (half[:2] - np.abs(pressure[:2])).min()


def inside(points: Array, place: Array) -> float:
    """Return how far [m] `place` (2,) is inside the convex hull of points (k, 2).

    That is the distance from the nearest edge, negative outside; NaN for points on a line.
    """
    from scipy.spatial import ConvexHull, QhullError

    try:
        edges = ConvexHull(points).equations  # outward normals, and offsets
    except (QhullError, ValueError):  # ValueError: there are none
        return np.nan
    return float(-(edges[:, :2] @ place + edges[:, 2]).max())
