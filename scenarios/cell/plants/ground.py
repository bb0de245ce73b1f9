"""A robot on a floor as a MuJoCo scene in the format MJCF: torque motors, soles, friction."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np

from hierarchy import Robot, State
from hierarchy.avoidance.self_collision import measure_capsules, pack_capsules, pairs_of_tree
from hierarchy.contacts import Contact, Contacts
from hierarchy.problem import Array
from scenarios.cell.plants.mjcf import Element, add, add_body, axes, begin
from scenarios.config import ScenarioError
from scenarios.config.plant import TorqueSection

_LEAST = 1e-6, 1e-9  # [kg], [kg m^2] of a body that only joins two joints
_SKIN = 0.3             # friction of a link on another
_THICKNESS = 0.01    # [m] half of that of a sole
_SLIDING = 0.15      # [s] time constant of the friction of what slides
BALL = 0.001         # [m] radius of a point that touches


def on_floor(robot: Robot, contacts: Contacts, floor: TorqueSection, timestep: float, q: Array
             ) -> str:
    """Return the scene of a robot at q (nq,) whose `contacts` touch a horizontal floor.

    A sole is a box in the place of its corners, a point a small ball; nothing else touches
    anything, except capsules with `floor.self_collision`. Bodies are named "body JOINT", geometries
    by their contacts. Actuators are the torques of the actuated joints. What the robot couples or
    closes are equalities. Raises ScenarioError unless each joint, but for that of a floating base,
    turns about or slides along one axis.
    """
    root, world = begin(robot, timestep, cone="elliptic", integrator="Euler", tolerance=1e-12,
                        iterations="200")
    add(world, "geom", type="plane", name="the floor", size=(20, 20, 1), pos=(0, 0, floor.height))
    elements, pairs = _bodies(world, robot, floor, q), add(root, "contact")
    for contact in contacts.contacts:
        add(elements[contact.frame.joint], "geom", name=contact.name, contype="0",
            conaffinity="0", **_shape(contact))
        # MuJoCo raises the normal force of a sliding contact with the friction that it would take
        # to stop it at once; that of one that is to slide is softer, and the hand does not hop.
        along = _SLIDING if contact.slides else floor.softness
        add(pairs, "pair", geom1="the floor", geom2=contact.name, condim="3",
            friction=(floor.friction, floor.friction, 0, 0, 0), solref=(floor.softness, 1.0),
            solreffriction=(along, 1.0))
    if floor.self_collision:
        _capsules(elements, pairs, robot, q)
    _equalities(root, robot, elements, timestep)
    actuator = add(root, "actuator")
    for name, limit in zip(robot.velocity_names[robot.actuated:],
                           robot.effort_limit[robot.actuated:], strict=True):
        limits = {"ctrllimited": "true", "ctrlrange": (-limit, limit)} if np.isfinite(limit) else {}
        add(actuator, "motor", joint=name, **limits)
    return ElementTree.tostring(root, encoding="unicode")


def _capsules(elements: list[Element], contact: Element, robot: Robot, q: Array) -> None:
    """Add the capsules of a robot at q (nq,), and the pairs that may touch later."""
    for capsule in robot.capsules:
        same = capsule.start == capsule.end
        place: dict[str, Any] = {"pos": capsule.start} if same else {
            "fromto": (*capsule.start, *capsule.end)}
        add(elements[capsule.joint], "geom", name=f"capsule {capsule.name}", contype="0",
            conaffinity="0", type="sphere" if same else "capsule", size=capsule.radius, **place)
    pairs = np.array(pairs_of_tree(robot.capsules, robot.parents), dtype=np.int64).reshape(-1, 2)
    seen = measure_capsules(State.at(robot, q).placements, *pack_capsules(robot.capsules), pairs)
    for i, j in pairs[seen[:, 0] > 0.0]:
        names = (f"capsule {robot.capsules[k].name}" for k in (i, j))
        add(contact, "pair", **dict(zip(("geom1", "geom2"), names, strict=True)), condim="3",
            friction=(_SKIN, _SKIN, 0, 0, 0))


def _bodies(world: Element, robot: Robot, floor: TorqueSection, q: Array) -> list[Element]:
    of_joint, own, elements = _axes(robot), robot.model.armature, [world]
    for i, body in enumerate(robot.bodies()):
        element = add_body(elements[body.parent], body, _LEAST)
        elements.append(element)
        if i == 0 and robot.base == "floating":
            add(element, "joint", type="free", armature=own[0])
            continue
        kind, axis, v = of_joint[i + 1]
        # A joint that starts beyond its limit has its stop there.
        k = robot.coordinates[v]
        range_ = min(robot.lower[k], q[k]), max(robot.upper[k], q[k])
        stop = {"limited": "true", "range": range_} if (
            floor.stops and np.isfinite(range_).all()) else {}
        add(element, "joint", name=body.name, type=kind, axis=axis, damping=floor.joint_damping,
            armature=own[v] + floor.armature, frictionloss=floor.joint_friction, **stop)
    return elements


def _shape(contact: Contact) -> dict[str, Any]:
    """Return a box above the corners of a sole, or a ball around a point.

    The ball's lowest point in the start's posture need not be the contact's point.
    """
    frame, points = contact.frame, np.array(contact.points, dtype=float)
    if not contact.is_surface:
        return {"type": "sphere", "pos": frame.offset + frame.rotation @ points[0], "size": BALL}
    corners, R = points @ contact.sole.T, frame.rotation @ contact.sole.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = frame.offset + R @ ((low + high) / 2 + [0.0, 0.0, _THICKNESS])
    return {"type": "box", "pos": middle, "xyaxes": axes(R),
            "size": (*(high - low)[:2] / 2, _THICKNESS)}


def _equalities(root: Element, robot: Robot, elements: list[Element], timestep: float) -> None:
    """Add what the robot couples and closes, as stiff as the time step allows."""
    equality = add(root, "equality")
    stiff = {"solref": (2.0 * timestep, 1.0), "solimp": (0.9999, 0.9999, 0.001)}
    for one in robot.coupled:
        joints = {"joint1": one.joint} | ({"joint2": one.other} if one.other else {})
        add(equality, "joint", **joints, polycoef=(*one.coefficients, *[0.0] * 5)[:5], **stiff)
    for loop in robot.loops:
        sites = {f"site{i}": f"{loop.name} {i}" for i in (1, 2)}
        for name, frame in zip(sites.values(), map(robot.frame, loop.frames), strict=True):
            add(elements[frame.joint], "site", name=name, pos=frame.offset,
                xyaxes=axes(frame.rotation))
        add(equality, "weld" if loop.rigid else "connect", **sites, **stiff)


def _axes(robot: Robot) -> dict[int, tuple[str, Array, int]]:
    """Return kind, axis (3,) in its own frame, and velocity of each joint with one velocity."""
    state, found = State(robot), {}
    for joint in range(2 if robot.base == "floating" else 1, len(robot.parents)):
        own = np.flatnonzero(state.supports[joint] & ~state.supports[robot.parents[joint]])
        slide, turn = state.J[:3, own].sum(axis=1), state.J[3:, own].sum(axis=1)
        kind, axis = ("hinge", turn) if turn.any() else ("slide", slide)
        if len(own) != 1 or abs(np.linalg.norm(axis) - 1.0) > 1e-9:
            raise ScenarioError(f"joint {robot.joint_names[joint - 1]!r} does not turn about or "
                                "slide along one axis")
        found[joint] = kind, state.placements[joint, :9].reshape(3, 3) @ axis, int(own[0])
    return found
