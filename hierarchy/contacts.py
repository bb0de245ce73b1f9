"""Contacts: points of a robot that push on rigid surroundings, and the unknowns that they add.

With contacts the unknowns of a stack are x = (a, f): n joint accelerations and three components of
force for each contact point. The equations of motion are linear in both,

    M(q) a + h(q, v) = S^T tau + J_c^T f,

where S picks the actuated joints: the rows of a floating base have no torque, and the others say
which torques an x takes. Source: L. Sentis, O. Khatib, "Synthesis of Whole-Body Behaviors through
Hierarchical Control of Behavioral Primitives", International Journal of Humanoid Robotics (2005).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.avoidance.body import ControlPoint, Points, pack_points
from hierarchy.errors import HierarchyError, check_name, expect, expect_each, finite_numbers, refuse
from hierarchy.gate import array_of, axes_along, readable, shaped
from hierarchy.jit import compiled
from hierarchy.kinematics import crossed, dot, place, row_times, write_point_jacobian
from hierarchy.problem import Array
from hierarchy.records import NotNegative, Positive, check_fields, set_frozen
from hierarchy.robot import Frame, Robot
from hierarchy.state import State

Vector = Sequence[float]


@dataclass(frozen=True)
class Contact:
    """Points fixed to one frame that can push against a rigid surface.

    `points` (k, 3) [m] are in the frame: one for a point contact, at least three that are not on
    one line for a surface, such as the corners of a sole. `friction` is Coulomb's coefficient,
    `normal` (3,) the direction in the world in which the surface pushes the robot, `up` (3,) the
    same direction as the frame has it, across a sole. `open` has the intervals (from, until) [s] of
    a contact that lifts off and touches down, `ramp` [s] how long its load falls before each and
    may rise after it. A point that `slides` moves along its surface, against which friction then
    acts with all its coefficient. The name is that of the frame unless given.

    Raises HierarchyError, naming the contact, if the coefficient is not positive, a direction is
    zero, a number is not finite, the points are on a line, an interval ends before it begins, or a
    surface slides.
    """

    frame: Frame
    points: Sequence[Vector] = ((0.0, 0.0, 0.0),)
    friction: Positive = 0.7
    normal: Vector = (0.0, 0.0, 1.0)
    name: str = ""
    open: Sequence[tuple[float, float]] = ()
    ramp: Annotated[NotNegative, "s"] = 0.1
    slides: bool = False
    up: Vector = (0.0, 0.0, 1.0)
    axes: Array = field(init=False, repr=False, compare=False)  # (3, 3) rows: two tangents, normal
    sole: Array = field(init=False, repr=False, compare=False)  # the same in the frame, of `up`

    def __post_init__(self) -> None:
        expect("contact: frame", self.frame, Frame, "give robot.frame(name)")
        expect("contact: slides", self.slides, bool, "give True or False")
        set_frozen(self, name=self.name if str(self.name) else self.frame.name)
        what = f"contact {self.name!r}"
        check_fields(self, what)
        points, spans = (array_of(f"{what}: {key}", getattr(self, key))
                         for key in ("points", "open"))
        axes, sole = (axes_along(f"{what}: {key}", getattr(self, key)) for key in ("normal", "up"))
        refuse(points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all(),
               f"{what}: points {self.points!r} are not (k, 3) numbers")
        refuse(len(points) != 1 and np.linalg.matrix_rank(points - points.mean(0), tol=1e-6) < 2,
               f"{what}: {len(points)} points on one line; a contact has one point, or at least "
               "three of a surface")
        refuse(spans.size and (spans.shape[1:] != (2,) or not (spans[:, 0] < spans[:, 1]).all()),
               f"{what}: open {self.open!r}, expected pairs of times [s], each from a time until a "
               "later one")
        refuse(self.slides and len(points) > 1, f"{what}: {len(points)} points that slide; only a "
               "contact of one point does")
        set_frozen(self, axes=axes, sole=sole)

    @classmethod
    def rectangle(cls, frame: Frame, x: tuple[float, float], y: tuple[float, float],
                  friction: float = 0.7, open: Sequence[tuple[float, float]] = (),
                  ramp: float = 0.1, *, normal: Vector = (0.0, 0.0, 1.0),
                  up: Vector = (0.0, 0.0, 1.0)) -> Contact:
        """Return a sole across `up` through the origin of its frame: see `corners`."""
        return cls(frame, corners(x, y, up).tolist(), friction, normal, open=open, ramp=ramp, up=up)

    def load(self, t: float) -> float:
        """Share of its load that the contact may carry at t [s]: 0 while it is open."""
        away = min((max(start - t, t - end) for start, end in self.open), default=np.inf)
        return 0.0 if away <= 0.0 else min(1.0, away / self.ramp) if self.ramp else 1.0

    @property
    def is_surface(self) -> bool:
        """Whether the contact has several points, and so holds the orientation of its frame."""
        return len(self.points) > 1


@dataclass(frozen=True)
class Contacts:
    """The contacts of a robot, and the unknowns x = (a, f) of a stack at level "torque".

    a (n,) are the joint accelerations [rad/s^2 or m/s^2], f (3 p,) the forces on the robot [N] in
    world axes, three components a point, in the order of `contacts` and of their points. Without
    contacts x = a. Raises HierarchyError if two contacts share a name, one is on a body that no
    joint moves, or the robot has no masses.
    """

    robot: Robot
    contacts: Sequence[Contact] = ()
    points: Points = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        expect("contacts: robot", self.robot, Robot, "make one with Robot.load(name or file)")
        expect_each("contacts", self.contacts, Contact, "give a list of contacts")
        contacts = tuple(self.contacts)
        set_frozen(self, contacts=contacts)
        refuse(not self.robot.masses.sum() > 0.0, f"robot {self.robot.name!r} has no masses, so "
               "no torque or force moves it")
        for i, contact in enumerate(contacts):
            refuse(contact.name in self.names[:i], f"contact {contact.name!r}: two contacts have "
                   "this name")
            refuse(contact.frame.joint == 0, f"contact {contact.name!r}: no joint moves frame "
                   f"{contact.frame.name!r}")
            self.robot.check_joint(f"contact {contact.name!r}", contact.frame.joint,
                                   contact.frame.of)
        set_frozen(self, points=pack_points([
            ControlPoint(contact.name, contact.frame.joint, contact.frame.placed(point))
            for contact in contacts for point in contact.points]))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the contacts."""
        return tuple(contact.name for contact in self.contacts)

    @property
    def unknowns(self) -> int:
        """Number of unknowns, n + 3 p."""
        return self.robot.n + 3 * len(self.points.joints)

    @cached_property
    def blocks(self) -> dict[str, slice]:
        """The part of x that holds the "accelerations", and the forces of each contact by name."""
        blocks, at = {"accelerations": slice(0, self.robot.n)}, self.robot.n
        for contact in self.contacts:
            blocks[contact.name] = slice(at, at := at + 3 * len(contact.points))
        return blocks

    def __getitem__(self, name: str) -> Contact:
        check_name("contact", name, self.names)
        return self.contacts[self.names.index(name)]

    def accelerations(self, x: ArrayLike) -> Array:
        """Joint accelerations (n,) [rad/s^2 or m/s^2] of an x."""
        return self._checked(x)[:self.robot.n]

    def forces(self, x: ArrayLike, contact: str | None = None) -> Array:
        """Forces (k, 3) [N] at the points of one contact of an x, or of all."""
        x = self._checked(x)
        part = slice(self.robot.n, None) if contact is None else self.blocks[self[contact].name]
        return x[part].reshape(-1, 3)

    def carried(self, t: float, x: ArrayLike, before: Array | None) -> Array:
        """Normal force (C,) [N] of each contact in an x at t [s]: `State.carried` of the next tick.

        Of a contact in its ramp it is that of `before`, of an open one NaN.
        """
        carried, before = np.full(len(self.contacts), np.nan), self.before(before)
        for k, contact in enumerate(self.contacts):
            load = contact.load(t)
            if load == 1.0:
                carried[k] = (self.forces(x, contact.name) @ contact.axes[2]).sum()
            elif load > 0.0:
                carried[k] = before[k]
        return carried

    def before(self, carried: Array | None) -> Array:
        """Return what a `State.carried` says of each contact (C,) [N], NaN for nothing."""
        count = len(self.contacts)
        return np.full(count, np.nan) if carried is None else shaped(
            "contacts: state.carried", carried, (count,))

    def torques(self, state: State, x: ArrayLike) -> Array:
        """Torques M a + h - J_c^T f (n,) [N m or N] of the actuated joints that an x takes."""
        self._check(state)
        torques = np.empty(self.robot.n - self.robot.actuated)
        _write_torques(*state.dynamics, state.kinematics, self.points, self._checked(x), torques)
        return torques

    def jacobian(self, state: State) -> Array:
        """Jacobian J_c (3 p, n) of all contact points [m], world axes."""
        self._check(state)
        J = np.empty((3 * len(self.points.joints), state.n))
        _write_jacobian(state.kinematics, self.points, J)
        return J

    def _check(self, state: State) -> None:
        expect("contacts: state", state, State, "make one with State.at(robot, q)")
        self.robot.check_same("contacts: state", state.robot)

    def _checked(self, x: ArrayLike) -> Array:
        x = readable("contacts: x", x)
        if x.shape != (self.unknowns,):
            raise HierarchyError(f"x has shape {x.shape}, expected ({self.unknowns},): "
                                 f"{self.robot.n} accelerations and "
                                 f"{self.unknowns - self.robot.n} components of force")
        return x


def zero_while_open(write: Callable[[], object], state: State, contacts: Contacts,
                    parts: Sequence[Sequence[Array]]) -> Callable[[], object]:
    """Return `write`, followed by zeros in the `parts` of each contact that is open at the time."""
    opening = [pair for pair in zip(contacts.contacts, parts, strict=True) if pair[0].open]

    def write_and_zero() -> None:
        write()
        for contact, arrays in opening:
            if contact.load(state.t) == 0.0:
                for array in arrays:
                    array[:] = 0.0

    return write_and_zero if opening else write


def corners(x: tuple[float, float], y: tuple[float, float], up: Vector = (0.0, 0.0, 1.0)) -> Array:
    """Return the corners (4, 3) [m] of a sole from its sides `x` and `y` (2,) [m] across `up` (3,).

    x is the frame's x axis as seen along `up`, its y axis for `up` along x, and y is across both.
    Raises HierarchyError unless the sides are two numbers each and `up` is a direction.
    """
    sides = finite_numbers("sole: x [m]", x, 2), finite_numbers("sole: y [m]", y, 2)
    around = np.array([sides[0][[0, 1, 1, 0]], sides[1][[0, 0, 1, 1]]])
    return np.asarray(around.T @ axes_along("sole: up", up)[:2])


@compiled
def _write_torques(M, h, kinematics, points, x, torques):
    J, placements, supports = kinematics.J, kinematics.placements, kinematics.supports
    n = M.shape[0]
    first = n - len(torques)
    for i in range(len(torques)):
        torques[i] = h[first + i] + row_times(M, first + i, x)
    for k in range(len(points.joints)):
        joint, f = points.joints[k], x[n + 3 * k:n + 3 * k + 3]
        m = crossed(place(placements[joint], points.offsets[k]), f)  # about the world's origin
        for i in range(len(torques)):
            c = first + i
            if supports[joint, c]:
                torques[i] -= dot(J[:3, c], f) + dot(J[3:, c], m)


@compiled
def _write_jacobian(kinematics, points, J):
    for k in range(len(points.joints)):
        write_point_jacobian(kinematics, points.joints[k], points.offsets[k], J[3 * k:])
