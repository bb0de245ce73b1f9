"""What a reader of a run needs beside its signals: facts about the robot and the resolver."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hierarchy import Robot
from hierarchy.avoidance import Capsule
from hierarchy.problem import Array
from hierarchy.robots import DHTable
from hierarchy.robots.table import Base
from scenarios.cell.robot import contacts_of, sensed_points
from scenarios.config import Scenario
from scenarios.config.plant import TorqueSection
from scenarios.recording.tree import (
    Joint,
    Matrix,
    Vector,
    capsules,
    joint_units,
    lowest,
    placements,
    tree_of,
)
from solvers.resolver import Handles, Resolver

Setting = bool | int | float | str | tuple[float | str, ...] | None


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

    joints : the kinematic tree. rest (nq,) : the robot's own posture.
    velocity_names, velocity_units (n,) : name of each velocity, and unit of a small step along it;
        position_units (nq,) : "rad", "m", or "1" of a ratio.
    points : the control points, then the end effector, whose axes are `tool` in its joint's frame.
    capsules : the links as they are drawn. floor [m] : height at which the robot stands.
    """

    name: str
    base: Base
    joints: tuple[Joint, ...]
    rest: tuple[float, ...]
    velocity_names: tuple[str, ...]
    position_units: tuple[str, ...]
    velocity_units: tuple[str, ...]
    points: tuple[Point, ...]
    tool: Matrix
    capsules: tuple[Capsule, ...]
    floor: float

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return tuple(joint.name for joint in self.joints)

    @property
    def is_chain(self) -> bool:
        """Whether the robot is one chain from a fixed base."""
        return self.base == "fixed" and all(
            joint.parent == i for i, joint in enumerate(self.joints))

    def placements(self, q: Array) -> Array:
        """Return the joints' placements (..., J + 1, 12) at q (..., nq), as in a State."""
        return placements(self.joints, q)


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


def facts_of(scenario: Scenario, robot: Robot) -> Facts:
    """Return the facts of a scenario on its robot."""
    facts, plant = robot_facts(robot, scenario.sensor.foot), scenario.plant
    if isinstance(plant, TorqueSection) and facts.base == "floating":
        facts = replace(facts, floor=plant.height)
    return Facts(facts, resolver_facts(scenario), scenario.asks, scenario.limits_in_stack,
                 contact_points(scenario, robot))


def contact_points(scenario: Scenario, robot: Robot) -> tuple[ContactPoint, ...]:
    """Return the contact points of a scenario on its robot, none but at level "torque"."""
    contacts = contacts_of(scenario, robot)
    if contacts is None:
        return ()
    of = [contact for contact in contacts.contacts for _ in contact.points]
    return tuple(ContactPoint(contact.name, int(joint), _vector(offset), _vector(contact.axes[2]),
                              contact.friction)
                 for contact, joint, offset in zip(of, *contacts.points, strict=True))


def robot_facts(robot: Robot, foot: float = 0.0) -> RobotFacts:
    """Return the facts of a robot; one given as a table stands on a column of height `foot` [m]."""
    foot = foot if isinstance(robot.table, DHTable) else 0.0
    links, tip = capsules(robot, foot), robot.frame(robot.end_effector)
    points = tuple(Point(point.name, point.joint, _vector(point.offset))
                   for point in sensed_points(robot))
    x, y, z = (_vector(row) for row in tip.rotation)
    joints = tree_of(robot)
    return RobotFacts(robot.name, robot.base, joints, tuple(robot.rest.tolist()),
                      tuple(robot.velocity_names), *joint_units(joints), points, (x, y, z), links,
                      -foot if foot else lowest(robot, links))


def resolver_facts(scenario: Scenario) -> ResolverFacts:
    """Return the facts of the resolver that a scenario names."""
    resolver = scenario.make_resolver()
    settings = {field.name: _plain(getattr(resolver, field.name))
                for field in dataclasses.fields(resolver)}
    return ResolverFacts(resolver.name, str(resolver.label), resolver.strict,
                         float(resolver.accuracy), resolver.handles, settings,
                         _damped(resolver, scenario.asks))


def _damped(resolver: Resolver, asked: Handles) -> str:
    if not resolver.damping:
        return ""
    return resolver.damps if asked == "equalities" else resolver.damps_with_bounds


def _plain(value: Any) -> Setting:
    """Return a setting if JSON has it, else as text."""
    if isinstance(value, tuple) and all(_plain(one) == one for one in value):
        return value
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    return value if isinstance(value, (bool, int, float, str, type(None))) else repr(value)


def _vector(values: Any) -> Vector:
    x, y, z = np.asarray(values, dtype=float).tolist()
    return x, y, z
