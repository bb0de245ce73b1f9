"""An arm in MuJoCo with position servos, commanded in joint positions as through KUKA's FRI."""

from collections.abc import Mapping
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy import Robot, State
from hierarchy.avoidance import Obstacles
from hierarchy.jit import bind, compiled
from hierarchy.problem import Array
from hierarchy.robots import TABLES, DHTable
from hierarchy.task import Level
from scenarios.cell.plants.mjcf import Stops, each, scene
from scenarios.cell.plants.plant import after
from scenarios.config import ScenarioError
from scenarios.config.sections.plant import JointsSection, PhysicsSection, ServoSection

_ROUNDING = 1e-9  # of a number of steps
_ARMS = [name for name, table in TABLES.items() if isinstance(table, DHTable)]


class _Servo(NamedTuple):
    """Settings of the reference: period [s], joint limits (n,), lead, share fed forward."""

    period: float
    acceleration: bool
    lower: Array
    upper: Array
    lead: float
    feedforward: float


class _Reference(NamedTuple):
    """The servos' reference: position and rate (n,), acceleration, and its steps (steps, 2 n)."""

    q: Array
    v: Array
    a: Array
    steps: Array


class PhysicsArm:
    """Integrates commands to a reference that the servos of a simulated arm follow.

    `q`, `v` (n,) are the true joint state, `a` (n,) the acceleration of the last command,
    `reference_q`, `reference_v` (n,) the servos' reference at the end of the period [rad, s].
    `extra`: `contacts`, the largest number of simultaneous contact points between arm and obstacles
    in the last period, `contact_depth` [m] and `contact_force` [N], the largest normal force.
    Obstacles follow `obstacles` at each step; points have no body and no contacts.

    Raises ScenarioError if mujoco is not installed, or the robot is not given as a table.
    """

    def __init__(self, robot: Robot, q: Array, v: Array, period: float, level: Level,
                 obstacles: Obstacles | None = None, section: PhysicsSection | None = None
                 ) -> None:
        mujoco = mujoco_module()
        section = section or PhysicsSection(kind="mujoco")
        servo, joints = section.servo, section.joints
        if not isinstance(robot.table, DHTable):
            raise ScenarioError(f'plant.kind = "mujoco": robot {robot.name!r} is not one of '
                                f"{', '.join(_ARMS)}, the arms given as tables")
        self._steps = ceil(period * servo.rate - _ROUNDING)
        self._period = period
        self.stiffness, self.damping = _gains(robot, q, servo, joints)
        self._obstacles = obstacles or Obstacles()
        self.model = mujoco.MjModel.from_xml_string(
            scene(robot, q, self._obstacles.obstacles, joints, servo,
                  (self.stiffness, self.damping), period / self._steps))
        self.data = mujoco.MjData(self.model)
        self._step, self._force_of = mujoco.mj_step, mujoco.mj_contactForce
        self._servo = _Servo(period, level == "acceleration", robot.lower, robot.upper, servo.lead,
                             float(servo.feedforward))
        self._solid = [h for h, one in enumerate(self._obstacles.obstacles) if one.shape != "point"]
        self._stops = Stops(robot, q, section.beyond_stop)
        self._start(mujoco, q, v)

    def _start(self, mujoco: Any, q: Array, v: Array) -> None:
        self.data.qpos[:], self.data.qvel[:] = q, v
        self.q, self.v, self.a = q.copy(), v.copy(), np.zeros(len(v))
        self.reference_q, self.reference_v = q.copy(), v.copy()
        self._time, self._wrench = 0.0, np.zeros(6)
        self._command = np.zeros(len(v))
        self._references = np.zeros((self._steps, 2 * len(v)))
        self._follow = bind(
            _follow, self._command, self.q, self._servo,
            _Reference(self.reference_q, self.reference_v, self.a, self._references))
        self.extra: Mapping[str, NDArray[Any]] = {
            "contacts": np.zeros((), np.int16), "contact_depth": np.zeros(()),
            "contact_force": np.zeros(())}
        self._place(0.0)
        mujoco.mj_forward(self.model, self.data)

    def act(self, command: Array) -> None:
        """Apply a command (n,) for one period."""
        self._command[:] = command
        self._follow()
        for most in self.extra.values():
            most[...] = 0
        dt = self._period / self._steps
        for i, reference in enumerate(self._references):
            self._place(self._time + i * dt)
            self.data.ctrl[:] = reference
            self._step(self.model, self.data)
            if self.data.ncon:
                self._look_at_contacts()
        self._time += self._period
        self.q[:], self.v[:] = self.data.qpos, self.data.qvel

    @property
    def fault(self) -> str | None:
        """Why the arm cannot go on: a joint has passed its stop; or None."""
        return self._stops.passed(self.q)

    def _place(self, t: float) -> None:
        """Move the obstacles to their positions at time t [s]."""
        self._obstacles.at(t)
        if self._solid:
            self.data.mocap_pos[:] = self._obstacles.centres[self._solid]

    def _look_at_contacts(self) -> None:
        """Record the contacts of one step; all are between the arm and an obstacle."""
        contacts, (count, depth, force) = self.data.contact, self.extra.values()
        count[...] = max(int(count), len(contacts))
        depth[...] = max(float(depth), -float(contacts.dist.min()))
        for i in range(len(contacts)):
            self._force_of(self.model, self.data, i, self._wrench)
            force[...] = max(float(force), float(self._wrench[0]))


def mujoco_module() -> Any:
    """Return the module mujoco; ScenarioError, with the remedy, if it is not installed."""
    try:
        import mujoco
    except ImportError as error:
        raise ScenarioError('plant.kind = "mujoco" needs MuJoCo, which is not installed: '
                            "pip install 'task-hierarchy[sim]'") from error
    return mujoco


def _gains(robot: Robot, q: Array, servo: ServoSection,
           joints: JointsSection) -> tuple[Array, Array]:
    """Stiffness (n,) [N m/rad] and damping (n,) [N m s/rad] of critically damped servos."""
    bandwidth = each(servo.bandwidth, robot.n, "plant.servo.bandwidth")
    inertia = np.diag(State.at(robot, q).mass_matrix()) + each(
        joints.armature, robot.n, "plant.joints.armature")
    return inertia * bandwidth**2, 2.0 * inertia * bandwidth


@compiled
def _follow(x, q, servo, reference):
    """Move the reference by one command, and interpolate it: `reference.steps` (steps, 2 n)."""
    T, lead, n, steps = servo.period, servo.lead, len(q), reference.steps.shape[0]
    for i in range(n):
        reference.a[i], rate, step = after(x[i], T, servo.acceleration, reference.v[i])
        asked = reference.q[i] + step
        # A reference beyond a limit, where the arm started, may come back at its own pace.
        low, up = min(servo.lower[i], reference.q[i]), max(servo.upper[i], reference.q[i])
        allowed = min(max(asked, q[i] - lead, low), q[i] + lead, up)
        if allowed != asked:  # the reference is held, and its rate is what it still does
            step = allowed - reference.q[i]
            rate = step / T
        for k in range(steps):
            reference.steps[k, i] = reference.q[i] + step * (k + 1) / steps
            reference.steps[k, n + i] = servo.feedforward * step / T
        reference.q[i] += step
        reference.v[i] = rate
