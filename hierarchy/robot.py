"""Robot: a model of pinocchio with limits, frames, control points and capsules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from operator import attrgetter
from os import PathLike
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy import plugins
from hierarchy.avoidance.body import ControlPoint
from hierarchy.errors import (
    RobotError,
    UnknownNameError,
    as_float,
    brief,
    check_name,
    expect,
    expect_each,
    file_path,
    finite_numbers,
    is_one_of,
    naming,
    of_user,
    refuse,
    text,
    whole,
)
from hierarchy.gate import array_of, check_rotation, shaped
from hierarchy.problem import Array
from hierarchy.records import equal, set_frozen
from hierarchy.robots import TABLES
from hierarchy.robots.files import read_file
from hierarchy.robots.found import (
    Found,
    ambiguous,
    frames_called,
    in_words,
    inside,
    is_floating,
    points_along_chain,
    room,
)
from hierarchy.robots.from_table import from_table
from hierarchy.robots.joints import (
    check_size,
    coordinates_of,
    normalise,
    parts_of,
    set_joint,
    values_of,
)
from hierarchy.robots.library import pin
from hierarchy.robots.names import elsewhere, file_of, in_package, is_file_name
from hierarchy.robots.table import Base, Table
from hierarchy.words import some

ROBOTS = TABLES
BASE_SPEED = (2.0, 3.0)  # [m/s], [rad/s] of a floating base in inverse kinematics


@dataclass(frozen=True)
class Frame:
    """A frame fixed to the body that `joint` moves; offset (3,) [m] and rotation (3, 3) in it.

    `of` is the name of that joint, "" if unknown: a robot that calls it otherwise refuses the
    frame. Raises HierarchyError for numbers that are none of these.
    """

    name: str
    joint: int
    offset: Array
    rotation: Array
    of: str = field(default="", repr=False, compare=False)
    __eq__ = equal

    def __post_init__(self) -> None:
        what = f"frame {self.name!r}"
        check_rotation(f"{what}: rotation", self.rotation)
        expect(f"{what}: of", self.of, str, "give the name of a joint")
        set_frozen(self, joint=whole(f"{what}: joint", self.joint),
                   offset=finite_numbers(f"{what}: offset", self.offset, 3),
                   rotation=array_of(f"{what}: rotation", self.rotation))

    def placed(self, point: ArrayLike) -> Array:
        """Return a point (3,) [m] of the frame as the joint's frame has it."""
        return np.asarray(self.offset + self.rotation @ np.array(point, dtype=float))


@dataclass(frozen=True)
class Body:
    """The body that joint `name` moves, and the place of that joint on its parent's body.

    `parent` is the joint of the parent, 0 for the base;
    position (3,) [m] and rotation (3, 3) are those of the joint's frame in the parent's; mass [kg],
    centre of mass (3,) [m] and inertia about it (3, 3) [kg m^2] are in the joint's frame.
    """

    name: str
    parent: int
    position: Array
    rotation: Array
    mass: float
    centre: Array
    inertia: Array


def _sized(name: str, size: str) -> Any:
    """Return an array (n,) or (nq,) that can be set to numbers of that size alone."""
    def put(robot: Robot, value: ArrayLike) -> None:
        what = f"robot {robot.name!r}: {name}"
        array = shaped(what, value, (getattr(robot, size),))
        for (i,) in np.argwhere(np.isnan(array))[:1]:
            raise RobotError(f"{what}[{i}] is nan")
        setattr(robot, f"_{name}", array)

    return property(attrgetter(f"_{name}"), put)


class Robot:
    """A robot: its model, base, limits, frames, control points and capsules of its links.

    `n` is the number of velocities, `nq` of coordinates: a continuous joint has (cos, sin), a ball
    a quaternion (x, y, z, w), a planar joint (x, y, cos, sin), a free one location and quaternion;
    `parts` are these. A floating `base` has the first six velocities, in its own frame [m/s,
    rad/s]; `actuated` is the index of the first actuated velocity: 6 or 0. `lower`, `upper` (nq,)
    [rad or m], `velocity_limit` (n,) [rad/s or m/s] and `effort_limit` (n,) [N m or N] are infinite
    where the model has none, but for the speed of the base, see `limit_base`. `coordinates` (n,) is
    the index in q of the (first) position of each velocity, `velocity_units` (n) the unit of that,
    "rad" or "m"; `velocity_names` (n) and `coordinate_names` (nq) are those of joints, numbered
    where one has several. `parents`, `masses` [kg] and `centres` (joints + 1, 3) [m] have the joint
    that carries each joint, and the body that it moves. `rest` (nq,) is the default initial
    configuration. `missing` has sentences about what the file does not give, or gives and the robot
    is without; `coupled` joints follow another one in the file, `loops` are chains that it closes,
    `starts` the configurations (nq,) that it names, `apart` pairs of joints whose bodies it lets
    touch. `table` is the table that the robot was made from, or None.
    """

    lower: Array = _sized("lower", "nq")
    upper: Array = _sized("upper", "nq")
    velocity_limit: Array = _sized("velocity_limit", "n")
    effort_limit: Array = _sized("effort_limit", "n")
    rest: Array = _sized("rest", "nq")

    def __init__(self, model: Any, name: str, end_effector: str | None = None,
                 found: Found | None = None) -> None:
        expect("Robot: model", model, pin.Model, "Robot.load makes a robot of a name or a file")
        text("Robot: name", name)
        self.model, self.name = model, name
        self.n, self.nq = int(model.nv), int(model.nq)
        refuse(self.n == 0, f"robot {name!r} has no joint that moves; with base = 'floating' it "
               "moves as a whole", RobotError)
        check_size(model, f"robot {name!r}")
        self.base: Base = "floating" if is_floating(model) else "fixed"
        self.actuated = 6 if self.base == "floating" else 0
        self.joint_names: tuple[str, ...] = tuple(model.names)[1:]
        self.parents: tuple[int, ...] = tuple(int(i) for i in model.parents)
        _check_order(model, name)
        # pinocchio has huge numbers for "none".
        self.lower, self.upper = (np.where(np.abs(limit) > 1e300, none, limit) for limit, none in (
            (model.lowerPositionLimit, -np.inf), (model.upperPositionLimit, np.inf)))
        self.velocity_limit, self.effort_limit = (
            np.where((limit <= 0.0) | (limit > 1e300), np.inf, limit)
            for limit in (model.upperVelocityLimit, model.effortLimit))
        if self.base == "floating":
            self.lower[:7], self.upper[:7] = -np.inf, np.inf
            self.effort_limit[:6] = np.inf
            self.limit_base(*BASE_SPEED)
        self.parts = parts_of(model)
        for part in self.parts:
            if part.size > 1:  # of a cosine, a sine or an entry of a quaternion
                for limits, none in (self.lower, -np.inf), (self.upper, np.inf):
                    own = limits[part.q:part.q + part.size]
                    own[np.abs(own) == _UNIT] = none
        moved = [part for part in self.parts for _ in range(part.velocities)]
        self.coordinates = np.array([part.q for part in moved])
        self.velocity_units = [part.unit for part in moved]
        self.velocity_names, self.coordinate_names = (
            [f"{name} {i + 1}" if size > 1 else name
             for name, size in zip(self.joint_names, sizes, strict=True) for i in range(size)]
            for sizes in zip(*((joint.nv, joint.nq) for joint in model.joints[1:]), strict=True))
        inertias = list(model.inertias)
        self.masses = np.array([0.0, *(float(inertia.mass) for inertia in inertias[1:])])
        self.centres = np.array([np.zeros(3), *(inertia.lever for inertia in inertias[1:])])
        found = found or Found(model, self.frame_names[-1], control_points=())
        self.end_effector = found.end_effector if end_effector is None else end_effector
        self.frame(self.end_effector, "end_effector frame")
        self.control_points = (points_along_chain(model, self.end_effector)
                               if found.control_points is None else found.control_points)
        self.capsules, self.missing, self.coupled = found.capsules, found.missing, found.coupled
        self.rest = np.array(pin.neutral(model)) if found.rest is None else found.rest
        self._keep_couplings()
        self.loops, self.starts, self.apart = found.loops, found.starts, found.apart
        self.table = found.table

    def _keep_couplings(self) -> None:
        """Move `rest` to where the couplings have it; say which joints have no room to move."""
        leaders = {one.other for one in self.coupled} - {"", *(one.joint for one in self.coupled)}
        held = {one.joint: one.at(0.0) for one in self.coupled if not one.other}
        ends = {self.joint_names[part.joint - 1]: (self.lower[part.q], self.upper[part.q])
                for part in self.parts if part.size == 1}
        rooms = {name: room(name, ends, self.coupled) for name in (*ends, *leaders)}
        if still := [name for name, (low, high) in rooms.items() if low == high]:
            self.missing += (f"joints {some(still)} do not move: their position limits, 0 where a "
                             "URDF has none, and those of joints that follow leave no room",)
        if leaders or held:
            values = self.values(self.rest)
            self.rest = self.configuration(held | {
                name: inside(float(values[name]), *rooms[name]) for name in leaders}, self.rest)

    @classmethod
    def named(cls, name: str, base: Base | None = None) -> Robot:
        """Build a robot of `hierarchy.robot.ROBOTS` or of a plugin; UnknownNameError for another.

        A plugin registers a table, a file, a Robot, or a function that returns one of these.
        `base` "fixed" or "floating" overrides that of its table.
        """
        expect("Robot.named: name", name, str, "give a name of ROBOTS")
        _check_base(name, base)
        found = plugins.find("robots", name)
        if found is None:
            raise UnknownNameError("robot", name, plugins.known("robots"), elsewhere(name))
        with of_user(f"robot {name!r} of a plugin"):
            made = found if isinstance(found, Table | str | Path | cls) else found()
        if isinstance(made, str | Path):
            made = cls.from_file(made, base=base)
        elif isinstance(made, Table):
            table = from_table(made, base)
            made = cls(table.model, name, found=table)
        expect(f"robot {name!r} of a plugin", made, cls, "return a Robot, a table or a file")
        robot: Robot = made
        robot.name = name
        return robot

    @classmethod
    def from_file(cls, path: str | Path, end_effector: str | None = None,
                  base: Base | None = None, shapes: bool = True,
                  locked: Mapping[str, ArrayLike] | None = None,
                  root: str | Sequence[str] = ()) -> Robot:
        """Read a URDF or MJCF file (its root element says which); RobotError if it cannot.

        `end_effector` names a frame; without it one is proposed, see `hierarchy.robots.found`.
        `base` None is that of the file: floating if its first joint is free, else fixed. Capsules
        are proposed from the collision geometry, unless `shapes` is False, and control points along
        the chain to the end effector. `locked` joints are fixed at a value [rad or m], see
        `configuration`, and are not joints of the robot; what follows one of them is held too.
        `root` names the body, or bodies, of an MJCF at which the robot begins; without it
        everything is the robot but bodies that only float beside it.
        """
        path = file_path("Robot.from_file: path", path)
        _check_base(path, base)
        expect("Robot.from_file: shapes", shapes, bool, "give True or False")
        found = read_file(path, base, shapes, *_part(locked, root))
        return cls(found.model, Path(path).stem, end_effector, found)

    @classmethod
    def load(cls, model: str | Path, end_effector: str | None = None, base: Base | None = None,
             locked: Mapping[str, ArrayLike] | None = None,
             root: str | Sequence[str] = ()) -> Robot:
        """Make a robot by a name of `ROBOTS`, a file, or "package:name".

        Packages are example_robot_data and robot_descriptions (extra `descriptions`); the latter
        may download files. `locked` and `root` are those of `from_file`. Raises RobotError and
        UnknownNameError.
        """
        refuse(not isinstance(model, str | PathLike), "Robot.load: model: expected a name or a "
               f"file, got {brief(model)}", RobotError)
        model = str(model)
        if in_package(model):
            robot = cls.from_file(file_of(model), end_effector, base, locked=locked, root=root)
            robot.name = model.partition(":")[2]
            return robot
        if is_file_name(model):
            return cls.from_file(model, end_effector, base, locked=locked, root=root)
        refuse(any(map(len, _part(locked, root))), f"robot {model!r} is a table; its joints cannot "
               "be locked, and it has no other root", RobotError)
        robot = cls.named(model, base)
        if end_effector is not None:
            robot.end_effector = robot.frame(end_effector, "end_effector frame").name
        return robot

    @classmethod
    def of_text(cls, text: str, name: str) -> Robot:
        """Build a robot of `robot.model.saveToString()`; a damaged text raises RobotError."""
        model = pin.Model()
        with naming(f"robot {name!r}: its model cannot be read", RobotError,
                    (RuntimeError, MemoryError, ValueError, TypeError)):
            model.loadFromString(text)
        return cls(model, name)

    @property
    def shares(self) -> Array:
        """The share of all `masses` (joints + 1,) that each body has."""
        return self.masses / float(self.masses.sum())

    @property
    def frame_names(self) -> list[str]:
        """Names of the frames that `frame` finds, including those of joints and links."""
        unclear = set(ambiguous(self.model))
        names = dict.fromkeys(str(frame.name) for frame in self.model.frames)
        return [name for name in names if name not in unclear]

    def start(self, name: str) -> Array:
        """Return a copy of the configuration (nq,) that the file calls `name`; UnknownNameError."""
        check_name("keyframe", name, self.starts)
        return self.starts[name].copy()

    def joint(self, name: str) -> int:
        """Index of the joint called `name`, as used by frames and control points."""
        check_name("joint", name, self.joint_names)
        return self.joint_names.index(name) + 1

    def check_joint(self, what: str, joint: int, of: str = "") -> None:
        """Raise a RobotError for a joint that the robot lacks, or that it does not call `of`."""
        if not 0 <= joint < len(self.parents):
            raise RobotError(f"{what} is on joint {joint}, and robot {self.name!r} has "
                             f"{len(self.parents) - 1} joints: it is of another robot")
        if of and of != self.joint_names[joint - 1]:
            raise RobotError(f"{what} is on joint {of!r}, which is {self.joint_names[joint - 1]!r} "
                             f"of robot {self.name!r}: it is of another robot")

    def check_same(self, what: str, robot: Robot) -> None:
        """Raise a RobotError for another robot, which has other joints."""
        if (robot.joint_names, robot.nq) != (self.joint_names, self.nq):
            raise RobotError(f"{what} is of robot {robot.name!r}, not of {self.name!r}")

    def limit_base(self, linear: float, angular: float) -> None:
        """Limit the speed of a floating base [m/s, rad/s], inf for none; RobotError if fixed.

        Each of its first six velocities is limited by itself. `solve_ik` and limits of joints that
        include the base keep to it; by default `BASE_SPEED`, which no file says.
        """
        refuse(self.base != "floating", f"robot {self.name!r}: its base is fixed and has no speed",
               RobotError)
        for what, speed in (("linear", linear), ("angular", angular)):
            refuse(not as_float(speed) > 0.0, f"robot {self.name!r}: "
                   f"{what} speed of the base = {speed}, expected a number > 0", RobotError)
        self.velocity_limit[:6] = np.repeat([as_float(linear), as_float(angular)], 3)

    def frame(self, name: str, what: str = "frame") -> Frame:
        """Find the frame called `name`, which an error calls `what`.

        Raises UnknownNameError if there is none, and RobotError if two places have that name.
        """
        found = frames_called(self.model, name) if isinstance(name, str) else []
        if not found:
            raise UnknownNameError(what, name, self.frame_names)
        if len(found) > 1:
            raise RobotError(f"robot {self.name!r}: {len(found)} frames are called {name!r}, "
                             f"{in_words(self.model, found)}; give one another name in the file")
        frame = found[0]
        joint = int(frame.parentJoint)
        return Frame(name, joint, frame.placement.translation, frame.placement.rotation,
                     self.joint_names[joint - 1] if joint else "")

    def control_point(self, joint: str, offset: ArrayLike) -> ControlPoint:
        """Attach a point to the body that `joint` moves; offset (3,) [m] in that joint's frame."""
        place = finite_numbers(f"control point on {joint!r}: offset", offset, 3)
        return ControlPoint(f"{joint} {place.tolist()}", self.joint(joint), place)

    def control_point_of_frame(self, frame: str, offset: ArrayLike) -> ControlPoint:
        """Attach a point to the body that carries `frame`; offset (3,) [m] in that frame."""
        held, place = self.frame(frame), finite_numbers(f"control point in {frame!r}: offset",
                                                        offset, 3)
        return ControlPoint(f"{frame} {place.tolist()}", held.joint, held.placed(place))

    def bodies(self) -> tuple[Body, ...]:
        """Return the robot's bodies in the order of its joints, to build it in another engine."""
        return tuple(
            Body(name, parent, at.translation.copy(), at.rotation.copy(), float(inertia.mass),
                 inertia.lever.copy(), inertia.inertia.copy())
            for name, parent, at, inertia in zip(self.joint_names, *(list(kept)[1:] for kept in (
                self.parents, self.model.jointPlacements, self.model.inertias)), strict=True))

    @cached_property
    def supports(self) -> NDArray[np.bool_]:
        """Whether a velocity moves a body (joints + 1, n); the first body is the world."""
        joints = [part.joint for part in self.parts for _ in range(part.velocities)]
        above = [set(chain.tolist()) for chain in self.model.supports]
        return np.array([[joint in chain for joint in joints] for chain in above], dtype=np.bool_)

    def position_limits(self) -> tuple[Array, Array]:
        """Return lower and upper (n,), (n,) [rad or m], one per velocity.

        They are infinite for a continuous joint, whose coordinates are a cosine and a sine. Raises
        RobotError if another joint with more coordinates than velocities has a limit.
        """
        for name, of, velocities in self._several:
            if np.isfinite([self.lower[of], self.upper[of]]).any():
                raise RobotError(f"robot {self.name!r}: joint {name!r} has {of.stop - of.start} "
                                 f"coordinates for {velocities} velocities; limits "
                                 "of its positions are not supported")
        return self.lower[self.coordinates], self.upper[self.coordinates]

    @cached_property
    def _several(self) -> list[tuple[str, slice, int]]:
        """The joints with more coordinates than velocities: their span in q, and how many."""
        return [(name, slice(joint.idx_q, joint.idx_q + joint.nq), joint.nv)
                for name, joint in zip(self.joint_names, self.model.joints[1:], strict=True)
                if joint.nq != joint.nv]

    def configuration(self, values: ArrayLike | Mapping[str, ArrayLike],
                      q: ArrayLike | None = None) -> Array:
        """Return q (nq,), by default `rest`, with some joints set by name, or all [rad or m].

        A value has a number for each velocity of the joint: an angle for a continuous one, a
        rotation vector for a ball, (x, y, angle) for a planar one, location and rotation vector for
        a free one. Or it has the joint's coordinates, with quaternions as (x, y, z, w). A joint
        that follows a named one in the file goes with it, unless it is named too. Without names
        `values` are those of all joints but a floating base, or all coordinates (nq,). Raises
        UnknownNameError, and RobotError, naming the joint, for anything else.
        """
        q = self.rest.copy() if q is None else self.normalised(q)
        if isinstance(values, Mapping):
            for name, value in values.items():
                set_joint(self.parts, q, self.joint(name), name, value)
            led = {one.joint: one.at(self.values(q)[one.other]) for one in self.coupled
                   if one.other in values and one.joint not in values}
            return self.configuration({**values, **led}, q) if led else q
        given = finite_numbers(f"robot {self.name!r}: configuration", values)
        joints = self.n - self.actuated
        if len(given) == self.nq:
            return self.normalised(given)
        if len(given) != joints:
            full = f" or {self.nq} coordinates" if self.nq != joints else ""
            raise RobotError(f"{len(given)} values for {joints} joint positions{full} of robot "
                             f"{self.name!r}")
        own = [part for part in self.parts if part.v >= self.actuated]
        q[own[0].q:] = coordinates_of(own, given)
        return q

    def values(self, q: ArrayLike) -> dict[str, float | Array]:
        """Return the value of each joint at q (nq,) by name, as `configuration` takes them.

        That is a number for a joint of one velocity, else one for each of its velocities.
        """
        found = self.vector(q)
        spans = [(joint.idx_v, joint.nv) for joint in self.model.joints[1:]]
        return {name: float(found[first]) if count == 1 else found[first:first + count]
                for name, (first, count) in zip(self.joint_names, spans, strict=True)}

    def vector(self, q: ArrayLike) -> Array:
        """Return the values of all joints at q (nq,) one after the other (n,), see `values`."""
        return values_of(self.parts, self.normalised(q))

    def normalised(self, q: ArrayLike) -> Array:
        """Return q (nq,) with quaternions and (cos, sin) of length one.

        Raises HierarchyError for another shape or a number that is not finite, and RobotError,
        naming the joint, where a length differs from one by more than 1e-6.
        """
        q = finite_numbers(f"robot {self.name!r}: q", q, self.nq)
        if self.nq != self.n:
            normalise(self.parts, q, ("", *self.joint_names))
        return q

    def integrate(self, q: ArrayLike, step: ArrayLike) -> Array:
        """Return q (nq,) moved by `step` (n,) [rad or m] along the joints.

        Raises what `normalised` raises.
        """
        q = self.normalised(q)
        step = finite_numbers(f"robot {self.name!r}: step", step, self.n)
        return np.asarray(pin.integrate(self.model, q, step))

    def difference(self, q: ArrayLike, to: ArrayLike) -> Array:
        """Return the step (n,) with which `integrate` moves q (nq,) to another configuration.

        The shortest way around: angles are at most pi. Raises what `normalised` raises.
        """
        q, to = self.normalised(q), self.normalised(to)
        return np.asarray(pin.difference(self.model, q, to))

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, n={self.n})"


def _check_order(model: Any, name: str) -> None:
    """Raise a RobotError unless branch comes after branch: pinocchio's inertia would be wrong."""
    for last, parent in enumerate(list(model.parents)[1:]):
        refuse(parent not in model.supports[last].tolist(), f"robot {name!r}: joint "
               f"{model.names[last + 1]!r} hangs on {model.names[parent]!r}, and other "
               "branches are between them; give branch after branch", RobotError)


def _check_base(model: str | Path, base: object) -> None:
    refuse(base is not None and not is_one_of(base, get_args(Base)), f"robot {str(model)!r}: base "
           f"must be one of {get_args(Base)}, got {base!r}", RobotError)


def _part(locked: object, root: object) -> tuple[Mapping[str, ArrayLike], Sequence[str]]:
    """Return the part of a file that is the robot; raise a HierarchyError for a wrong type."""
    locked, root = {} if locked is None else locked, [root] if isinstance(root, str) else root
    expect("Robot: locked", locked, Mapping, "give joints with their values")
    expect_each("Robot: root", root, str, "give the name of a body, or a list of names")
    return locked, root  # type: ignore[return-value]


_UNIT = 1.01  # limit in pinocchio of a cosine, a sine or an entry of a quaternion
