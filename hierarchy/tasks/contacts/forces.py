"""Rows over contact forces and of the equations of motion: forces, floating base, torque limits."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.contacts import Contact, Contacts, zero_while_open
from hierarchy.errors import finite_numbers, positive
from hierarchy.gate import shaped
from hierarchy.jit import bind, compiled
from hierarchy.kinematics import less, place
from hierarchy.problem import Array
from hierarchy.records import Positive
from hierarchy.robot import Robot
from hierarchy.state import State
from hierarchy.task import Level, Rows, Writer, Written, in_turn
from hierarchy.tasks.joints.joint_limits import JointRows

WRENCH = tuple(f"{kind} {axis}" for kind in ("force", "moment") for axis in "xyz")
OfContact = tuple[Sequence[str], ArrayLike, ArrayLike, ArrayLike]  # names, rows, lower, upper


class ForceTask(Written):
    """m rows over x = (a, f), the unknowns of `contacts`, at level "torque". Abstract.

    Such rows have no task variable and no gains: they say what x must satisfy. A new one needs
    `dimension` and `writer`, see `Task.writer`; A then has n + 3 p columns.
    """

    of_forces: ClassVar[bool] = True
    scale = 3.0  # N
    contacts: Contacts

    def error(self, state: State) -> Array:
        """The residual at x = 0 (m,), in the unit of the rows."""
        _, lower, upper = self.rows(state)
        return np.asarray(np.clip(0.0, lower, upper))


class FixedRows(ForceTask):
    """Rows over the forces of each contact, the same at any state. Abstract: needs `of_contact`."""

    @abstractmethod
    def of_contact(self, contact: Contact) -> OfContact:
        """Names (r,) of the rows of a contact, over its forces (r, 3 k), and their sides (r,)."""

    @property
    def row_names(self) -> tuple[str, ...]:
        """Contact and row."""
        return tuple(f"{contact.name} {row}" for contact in self.contacts.contacts
                     for row in self.of_contact(contact)[0])

    @property
    def fixed(self) -> Rows:
        """The rows over the unknowns (m, n + 3 p), their lower and upper sides (m,)."""
        (A, *sides), end = Rows.empty(self.dimension, self.contacts.unknowns), 0
        for contact in self.contacts.contacts:
            names, forces, *given = self.of_contact(contact)
            own = slice(end, end := end + len(names))
            A[own, self.contacts.blocks[contact.name]] = forces
            sides[0][own], sides[1][own] = given
        return Rows(A, *sides)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        return bind(_copy, *self.fixed, *rows)


@compiled
def _copy(rows, low, up, A, lower, upper):
    for i in range(rows.shape[0]):
        for c in range(rows.shape[1]):
            A[i, c] = rows[i, c]
        lower[i], upper[i] = low[i], up[i]


@dataclass(frozen=True)
class ContactForce(ForceTask):
    """Let the surroundings push on one contact with `target`, the sum over its points.

    `target` has 1 number for the normal force [N], 3 for the force in world axes [N], or 6 for the
    wrench: the force, and the moment about the origin of the contact's frame [N m], world axes. The
    force is that on the robot: a hand that presses with 20 N has the normal force 20. One row per
    number. Raises UnknownNameError for an unknown contact, and HierarchyError for another number of
    numbers or one that is not finite.
    """

    contacts: Contacts
    contact: str
    target: Sequence[float]
    name: str = "contact force"

    def __post_init__(self) -> None:
        super().__post_init__()
        self.contacts[self.contact]
        count = len(finite_numbers(f"task {self.name!r}: target", self.target))
        self.refuse(count not in (1, 3, 6), f"target {self.target!r} is not 1, 3 or 6 numbers")

    @property
    def row_names(self) -> tuple[str, ...]:
        """Force and moment along the axes, or the normal force."""
        return ("normal force",) if len(self.target) == 1 else WRENCH[:len(self.target)]

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        contact, frame = self.contacts[self.contact], self.contacts[self.contact].frame
        offsets = np.array([frame.placed(point) for point in contact.points])
        parameters = (frame.joint, frame.offset, offsets, np.array(self.target, dtype=float),
                      contact.axes[2:] if self.dimension == 1 else np.eye(3),
                      self.contacts.blocks[self.contact].start)
        return bind(_write, state.placements, parameters, *rows)


@compiled
def _write(placements, parameters, A, lower, upper):
    # The directions (1 or 3, 3) are those of the rows of the force, the origin is of the moment.
    joint, origin, offsets, target, directions, column = parameters
    T = placements[joint]
    for i in range(len(target)):
        A[i, :] = 0.0
        lower[i] = upper[i] = target[i]
    for k in range(len(offsets)):
        f = column + 3 * k
        for i in range(len(directions)):
            for c in range(3):
                A[i, f + c] = directions[i, c]
        if len(target) == 6:
            x, y, z = less(place(T, offsets[k]), place(T, origin))
            A[3, f + 1], A[3, f + 2] = -z, y  # the moment r x f
            A[4, f], A[4, f + 2] = z, -x
            A[5, f], A[5, f + 1] = -y, x


@dataclass(frozen=True)
class LeastForce(FixedRows):
    """Let the contact forces be as small as the levels above allow: f = 0 (m = 3 p) [N].

    As a last level it shares the load among the contact points, which the motion leaves open.
    """

    contacts: Contacts
    name: str = "least force"

    def of_contact(self, contact: Contact) -> OfContact:
        """A row of the identity for each axis of each point, zero."""
        names = [f"point {k + 1} {axis}" for k in range(len(contact.points)) for axis in "xyz"]
        return names, np.eye(len(names)), np.zeros(len(names)), np.zeros(len(names))


class TorqueRows(JointRows):
    """Rows of the joint torques, M(q) a + h(q, v) - J_c^T f, one per actuated joint. Abstract.

    At level "torque" the contacts are those of the stack, else there are none. The torques are
    those of the robot's model: rigid bodies, no friction, no payload.
    """

    contacts: Contacts | None
    kind = "inequality"
    of_forces: ClassVar[bool] = True
    straight = False
    levels: ClassVar[tuple[Level, ...]] = ("torque",)
    moving: ClassVar[bool] = False  # whether the bounds are others in each tick

    def __post_init__(self) -> None:
        super().__post_init__()
        self.refuse(self.robot.base == "floating" and self.contacts is None,
                    f"robot {self.robot.name!r} has a floating base; its torques depend on "
                    "contact forces, so give the contacts")

    def error(self, state: State) -> Array:
        """Distance of the torque with x = 0 from its bounds (n,) [N m or N]."""
        h = state.bias_effort()[self.robot.actuated:]
        return np.asarray(np.clip(h, *self.bounds(state)) - h)

    @abstractmethod
    def bounds(self, state: State) -> tuple[Array, Array]:
        """The bounds of the torques (n,), (n,) [N m or N]."""

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`; HierarchyError at another level than `levels`."""
        self.refuse(level not in self.levels, "its rows are for the level "
                    f"{' or '.join(self.levels)}, not {level!r}")
        contacts = Contacts(self.robot) if self.contacts is None else self.contacts
        bounds = np.array(self.bounds(state))
        write_rows = _efforts(contacts, self.robot.actuated, bounds, state, rows)

        def follow() -> None:
            bounds[0], bounds[1] = self.bounds(state)

        return in_turn(follow, write_rows) if self.moving else write_rows


@dataclass(frozen=True)
class TorqueLimits(TorqueRows):
    """Keep every joint torque within its limits: -limit <= M(q) a + h(q, v) - J_c^T f <= limit.

    One row per actuated joint, n in number below, at acceleration level without contacts and at
    level "torque" with those of the stack. The limit is `fraction`, more than 0 and at most 1, of
    the robot's `effort_limit` [N m or N]; rows of joints without one have infinite bounds.

    Raises HierarchyError for another fraction, or a floating base without contacts.
    """

    robot: Robot
    fraction: Annotated[float, partial(positive, largest=1.0)] = 1.0
    name: str = "torque limits"
    contacts: Contacts | None = None
    levels = "acceleration", "torque"

    def bounds(self, state: State) -> tuple[Array, Array]:
        """The limits, at any state."""
        limit = self.fraction * self.robot.effort_limit[self.robot.actuated:]
        return -limit, limit


@dataclass(frozen=True)
class TorqueStep(TorqueRows):
    """Keep every joint torque within `step` [N m or N] of that in `State.commanded`.

    A level for torques that a motor can follow, at level "torque": below the limits of torques and
    friction, which come first where both cannot hold. Without commanded torques its bounds are
    infinite. Raises HierarchyError for a step that is not positive, or a floating base without
    contacts.
    """

    robot: Robot
    step: Positive
    name: str = "torque step"
    contacts: Contacts | None = None
    moving = True

    def bounds(self, state: State) -> tuple[Array, Array]:
        """The commanded torques less and plus the step."""
        if (last := state.commanded) is None:
            unbounded = np.full(self.dimension, inf)
            return -unbounded, unbounded
        last = shaped(f"task {self.name!r}: state.commanded", last, (self.dimension,))
        return last - self.step, last + self.step


def _efforts(contacts: Contacts, first: int, bounds: Array, state: State, rows: Rows) -> Writer:
    """Return what writes M a + h - J_c^T f within bounds (2, m); open contacts transmit nothing."""
    M, h = state.dynamics
    write_rows = bind(write_torques, (M, h, state.kinematics, contacts.points, first), bounds,
                      *rows)
    forces = [(rows.A[:, contacts.blocks[contact.name]],) for contact in contacts.contacts]
    return zero_while_open(write_rows, state, contacts, forces)


@compiled
def write_torques(parameters, bounds, A, lower, upper):
    """Write rows of M a + h - J_c^T f within bounds (2, m), of the velocities from `first` on."""
    M, h, kinematics, points, first = parameters
    J, placements, supports = kinematics.J, kinematics.placements, kinematics.supports
    for i in range(len(lower)):
        for c in range(len(h)):
            A[i, c] = M[first + i, c]
        lower[i], upper[i] = bounds[0, i] - h[first + i], bounds[1, i] - h[first + i]
    for k in range(len(points.joints)):
        joint, f = points.joints[k], len(h) + 3 * k
        x, y, z = place(placements[joint], points.offsets[k])
        for i in range(len(lower)):
            c = first + i
            if supports[joint, c]:
                A[i, f] = J[5, c] * y - J[4, c] * z - J[0, c]
                A[i, f + 1] = J[3, c] * z - J[5, c] * x - J[1, c]
                A[i, f + 2] = J[4, c] * x - J[3, c] * y - J[2, c]
            else:
                A[i, f], A[i, f + 1], A[i, f + 2] = 0.0, 0.0, 0.0


@dataclass(frozen=True)
class BaseDynamics(ForceTask):
    """Let the contact forces move the base: M_b(q) a + h_b(q, v) = J_cb^T f [N, N m].

    Six rows, those of the floating base; none for a fixed one. It belongs at the top of a stack: an
    x that violates it cannot happen. A contact without load moves nothing; without contacts the
    rows say that the robot falls.

    Source: A. Herzog et al., "Momentum control with hierarchical inverse dynamics on a
    torque-controlled humanoid", Autonomous Robots (2016), eq. (7).
    """

    contacts: Contacts
    name: str = "base dynamics"

    @property
    def row_names(self) -> tuple[str, ...]:
        """Force and moment along the axes of the base, or none for a fixed one."""
        return WRENCH[:self.contacts.robot.actuated]

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        return _efforts(self.contacts, 0, np.zeros((2, self.dimension)), state, rows)
