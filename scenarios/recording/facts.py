"""What a reader of a run needs beside its signals: facts about the robot and the resolver."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from hashlib import sha256
from typing import Any

import numpy as np

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Capsule
from hierarchy.avoidance.body import Vector
from hierarchy.contacts import Contacts
from hierarchy.problem import Array
from hierarchy.robots import DHTable
from hierarchy.robots.shapes import vector
from hierarchy.robots.table import Base
from scenarios.cell.robot import on_column, sensed_points
from scenarios.config import Scenario
from scenarios.config.sections.plant import TorqueSection
from solvers.resolver import Handles

Matrix = tuple[Vector, Vector, Vector]
Setting = bool | int | float | str | tuple[float | str, ...] | None

_STICK = 0.08  # radius of a link without capsules, relative to the robot's longest link


@dataclass(frozen=True)
class Point:
    """A point fixed to the body that `joint` (an index) moves; offset (3,) [m] in its frame."""

    name: str
    joint: int
    offset: Vector


@dataclass(frozen=True)
class ContactPoint:
    """A point of a contact: where it is, as of a Point, and its surface as the controller has it.

    `normal` (3,) in the world has length one; `friction` is Coulomb's coefficient.
    """

    contact: str
    joint: int
    offset: Vector
    normal: Vector
    friction: float


@dataclass(frozen=True)
class RobotFacts:
    """What readers of a run need to know of the robot.

    model : pinocchio's, as `saveToString` writes it, and `digest` its SHA-256, without which
        pinocchio would read what is damaged. is_chain : whether it is one chain of joints
        from a fixed base. rest (nq,) : the robot's own posture.
    velocity_names, velocity_units (n,) : name of each velocity, and unit of a small step along it;
        position_units (nq,) : "rad", "m", or "1" of a ratio.
    points : the control points, then the end effector, whose axes are `tool` in its joint's frame.
    capsules : the links as they are drawn. floor [m] : height at which the robot stands.
    """

    name: str
    base: Base
    model: str
    digest: str
    joint_names: tuple[str, ...]
    is_chain: bool
    rest: tuple[float, ...]
    velocity_names: tuple[str, ...]
    position_units: tuple[str, ...]
    velocity_units: tuple[str, ...]
    points: tuple[Point, ...]
    tool: Matrix
    capsules: tuple[Capsule, ...]
    floor: float

    @property
    def actuated(self) -> int:
        """The first velocity of a joint: those before are a floating base's."""
        return 6 if self.base == "floating" else 0

    @property
    def joint_units(self) -> dict[str, str]:
        """The unit along each velocity of a joint, by its name; not of a floating base."""
        return dict(zip(self.velocity_names[self.actuated:], self.velocity_units[self.actuated:],
                        strict=True))

    @property
    def effort_units(self) -> tuple[str, ...]:
        """The unit of the effort along each velocity (n,)."""
        return tuple("N" if unit == "m" else "N m" for unit in self.velocity_units)

    @property
    def speed_names(self) -> tuple[str, ...]:
        """The name of each velocity, with its unit where that is not rad/s."""
        return tuple(name if unit == "rad" else f"{name} [{unit}/s]" for name, unit in zip(
            self.velocity_names, self.velocity_units, strict=True))

    @property
    def coordinate_names(self) -> list[str]:
        """The joint name of each entry of q (nq,), numbered where a joint has several."""
        return _bare(self.model, self.digest, self.name).coordinate_names

    def placements(self, q: Array) -> Array:
        """Return the placements (..., J + 1, 12) at q (..., nq), as in a State; NaN where q is."""
        state = State(_bare(self.model, self.digest, self.name))
        rows = np.reshape(q, (-1, np.shape(q)[-1]))
        found = np.full((len(rows), *state.placements.shape), np.nan)
        for k, row in enumerate(rows):
            if state.move(0.0, row, np.zeros(state.robot.n)):
                found[k] = state.placements
        return found.reshape(*np.shape(q)[:-1], *found.shape[1:])


@lru_cache(maxsize=8)
def _bare(model: str, digest: str, name: str) -> Robot:
    if sha256(model.encode()).hexdigest() != digest:
        raise HierarchyError(f"the model of robot {name!r} is damaged")
    return Robot.of_text(model, name)


@dataclass(frozen=True)
class ResolverFacts:
    """A resolver's properties of the same names, and its settings as they were used.

    damped : what it damped near singularities in the stack of the run; empty without damping.
    """

    name: str
    label: str
    strict: bool
    accuracy: float
    handles: Handles
    settings: dict[str, Setting]
    damped: str


@dataclass(frozen=True)
class Facts:
    """What a run is about: robot, resolver, and what the scenario asked of that resolver.

    `contacts` has the contact points at level "torque", in the order of their forces.
    """

    robot: RobotFacts
    resolver: ResolverFacts
    asks: Handles
    limits_in_stack: bool
    contacts: tuple[ContactPoint, ...] = ()


def facts_of(scenario: Scenario, robot: Robot, contacts: Contacts | None = None) -> Facts:
    """Return the facts of a scenario on its robot; `contacts` as in a Cell."""
    facts, plant = robot_facts(robot, scenario.sensor.foot), scenario.plant
    if isinstance(plant, TorqueSection) and facts.base == "floating":
        facts = replace(facts, floor=plant.height)
    points = tuple(ContactPoint(contact.name, contact.frame.joint,
                                vector(contact.frame.placed(point)), vector(contact.axes[2]),
                                contact.friction)
                   for contact in (contacts.contacts if contacts else ())
                   for point in contact.points)
    return Facts(facts, resolver_facts(scenario), scenario.asks, scenario.limits_in_stack, points)


def robot_facts(robot: Robot, foot: float = 0.0) -> RobotFacts:
    """Return the facts of a robot; one given as a table stands on a column of height `foot` [m]."""
    foot = foot if isinstance(robot.table, DHTable) else 0.0
    links, tip = capsules(robot, foot), robot.frame(robot.end_effector)
    points = tuple(Point(point.name, point.joint, vector(point.offset))
                   for point in sensed_points(robot))
    x, y, z = (vector(row) for row in tip.rotation)
    units, chain = tuple(robot.velocity_units), tuple(range(len(robot.joint_names)))
    model, radii = robot.model.saveToString(), [link.radius for link in links]
    # The lowest point of the robot at rest, at most as high as its base.
    low = ends(links, State.at(robot, robot.rest).placements)[..., 2].min(axis=-1) - radii
    return RobotFacts(
        robot.name, robot.base, model, sha256(model.encode()).hexdigest(), robot.joint_names,
        robot.base == "fixed" and robot.parents[1:] == chain, tuple(robot.rest.tolist()),
        tuple(robot.velocity_names),
        tuple(unit for part in robot.parts
              for unit in ((part.unit,) if part.size == 1 else ("1",) * part.size)),
        units, points, (x, y, z), links, -foot if foot else float(low.min(initial=0.0)))


def resolver_facts(scenario: Scenario) -> ResolverFacts:
    """Return the facts of the resolver that a scenario names."""
    resolver = scenario.make_resolver()
    settings = {field.name: _plain(getattr(resolver, field.name))
                for field in dataclasses.fields(resolver)}
    return ResolverFacts(resolver.name, str(resolver.label), resolver.strict,
                         float(resolver.accuracy), resolver.handles, settings,
                         "" if not resolver.damping else resolver.damps
                         if scenario.asks == "equalities" else resolver.damps_with_bounds)


def _plain(value: Any) -> Setting:
    """Return a setting if JSON has it, else as text."""
    if isinstance(value, tuple) and all(_plain(one) == one for one in value):
        return value
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    return value if isinstance(value, (bool, int, float, str, type(None))) else repr(value)


def capsules(robot: Robot, foot: float = 0.0) -> tuple[Capsule, ...]:
    """Return a robot's links: its capsules or, without any, sticks from joint to joint.

    With `foot` > 0 [m] the first is a column of that height below the base.
    """
    end = robot.frame(robot.end_effector)
    sticks = [(body.name, body.parent, body.position) for body in robot.bodies()]
    sticks = [stick for stick in (*sticks, (end.name, end.joint, end.offset))
              if np.linalg.norm(stick[2]) > 0.0]
    radius = _STICK * max((float(np.linalg.norm(stick[2])) for stick in sticks), default=0.0)
    return on_column(robot, robot.capsules or tuple(
        Capsule(name, joint, (0.0, 0.0, 0.0), vector(way), radius)
        for name, joint, way in sticks), foot)


def ends(links: Sequence[Capsule], placements: Array) -> Array:
    """Return start and end of each capsule in the world: (..., C, 2, 3) [m].

    placements (..., J + 1, 12), as in a State.
    """
    joints = np.array([link.joint for link in links], dtype=np.int64)
    return np.stack([placed_points(placements, joints, [getattr(link, side) for link in links])
                     for side in ("start", "end")], axis=-2)


def placed_points(placements: Array, joints: Any, offsets: Any) -> Array:
    """Return the world positions (..., K, 3) [m] of offsets (K, 3) in the frames of joints (K,)."""
    rows = placements[..., np.asarray(joints, dtype=np.int64), :]
    columns = rows[..., :9].reshape(*rows.shape[:-1], 3, 3)
    turned = np.einsum("...kci,kc->...ki", columns, np.reshape(offsets, (-1, 3)))
    return np.asarray(turned + rows[..., 9:])
