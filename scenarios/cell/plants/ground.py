"""A robot on a floor as a MuJoCo scene in the format MJCF: torque motors, soles, friction."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from hierarchy import Robot, State
from hierarchy.contacts import Contact, Contacts
from hierarchy.problem import Array
from hierarchy.robot import Body
from scenarios.cell.plants.mjcf import GRAVITY, text
from scenarios.config import ScenarioError
from scenarios.config.kinds.torque import TorqueSection

_LEAST_MASS, _LEAST_INERTIA = 1e-6, 1e-9  # [kg], [kg m^2] of a body that only joins two joints
_THICKNESS = 0.01                         # [m] half of that of a sole
_SLIDING = 0.15                           # [s] time constant of the friction of what slides
_FLOOR = "the floor"
BALL = 0.001                              # [m] radius of a point that touches
Element = ElementTree.Element


def on_floor(robot: Robot, contacts: Contacts, floor: TorqueSection, timestep: float) -> str:
    """Return the scene of a robot whose `contacts` touch a horizontal floor.

    A sole is a box in the place of its corners, a point a small ball; nothing else touches
    anything. Bodies are named "body JOINT", geometries by their contacts. Actuators are the torques
    of the actuated joints. What the robot couples or closes are equalities. Raises ScenarioError
    unless each joint, but for that of a floating base, turns about or slides along one axis.
    """
    root = Element("mujoco", model=robot.name)
    ElementTree.SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    option = ElementTree.SubElement(root, "option", timestep=repr(timestep), cone="elliptic",
                                    gravity=f"0 0 {-GRAVITY}", integrator="Euler",
                                    tolerance="1e-12", iterations="200")
    ElementTree.SubElement(option, "flag", autoreset="disable")
    world = ElementTree.SubElement(root, "worldbody")
    ElementTree.SubElement(world, "geom", type="plane", name=_FLOOR, size="20 20 1",
                           pos=text(0.0, 0.0, floor.height))
    elements, pairs = _bodies(world, robot, floor), ElementTree.SubElement(root, "contact")
    for contact in contacts.contacts:
        shape = _sole(contact) if contact.is_surface else _ball(contact)
        ElementTree.SubElement(elements[contact.frame.joint], "geom", {
            "name": contact.name, "contype": "0", "conaffinity": "0"} | shape)
        ElementTree.SubElement(pairs, "pair", _touching(contact, floor))
    _equalities(root, robot, elements, timestep)
    actuator = ElementTree.SubElement(root, "actuator")
    for name, limit in zip(robot.velocity_names[robot.actuated:],
                           robot.effort_limit[robot.actuated:], strict=True):
        motor = ElementTree.SubElement(actuator, "motor", joint=name)
        if np.isfinite(limit):
            motor.set("ctrllimited", "true")
            motor.set("ctrlrange", text(-limit, limit))
    return ElementTree.tostring(root, encoding="unicode")


def _bodies(world: Element, robot: Robot, floor: TorqueSection) -> list[Element]:
    axes, own, elements = _axes(robot), robot.model.armature, [world]
    for i, body in enumerate(robot.bodies()):
        element = _body(elements[body.parent], body)
        elements.append(element)
        if i == 0 and robot.base == "floating":
            ElementTree.SubElement(element, "joint", type="free", armature=text(own[0]))
            continue
        kind, axis, v = axes[i + 1]
        ElementTree.SubElement(element, "joint", name=body.name, type=kind,
                               axis=text(*axis), armature=text(own[v] + floor.armature),
                               frictionloss=text(floor.joint_friction))
    return elements


def _body(parent: Element, body: Body) -> Element:
    element = ElementTree.SubElement(parent, "body", name=f"body {body.name}",
                                     pos=text(*body.position),
                                     xyaxes=text(*body.rotation[:, 0], *body.rotation[:, 1]))
    I = body.inertia + _LEAST_INERTIA * np.eye(3)  # noqa: E741
    ElementTree.SubElement(
        element, "inertial", mass=text(max(body.mass, _LEAST_MASS)), pos=text(*body.centre),
        fullinertia=text(I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]))
    return element


def _touching(contact: Contact, floor: TorqueSection) -> dict[str, str]:
    """Return how a contact touches the floor.

    MuJoCo raises the normal force of a sliding contact with the friction that it would take to stop
    it at once, so that of a contact that is to slide is softer, and the hand does not hop.
    """
    along = _SLIDING if contact.slides else floor.softness
    return {"geom1": _FLOOR, "geom2": contact.name, "condim": "3",
            "friction": text(floor.friction, floor.friction, 0.0, 0.0, 0.0),
            "solref": text(floor.softness, 1.0), "solreffriction": text(along, 1.0)}


def _sole(contact: Contact) -> dict[str, str]:
    corners = np.array(contact.points, dtype=float) @ contact.sole.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    frame, R = contact.frame, contact.frame.rotation @ contact.sole.T
    middle = frame.offset + R @ ((low + high) / 2 + [0.0, 0.0, _THICKNESS])
    return {"type": "box", "pos": text(*middle), "xyaxes": text(*R[:, 0], *R[:, 1]),
            "size": text(*(high - low)[:2] / 2, _THICKNESS)}


def _ball(contact: Contact) -> dict[str, str]:
    """Return a ball whose lowest point in the start's posture need not be the contact's point."""
    frame = contact.frame
    point = frame.offset + frame.rotation @ np.array(contact.points[0], dtype=float)
    return {"type": "sphere", "pos": text(*point), "size": text(BALL)}


def _equalities(root: Element, robot: Robot, elements: list[Element], timestep: float) -> None:
    """Add what the robot couples and closes, as stiff as the time step allows."""
    equality = ElementTree.SubElement(root, "equality")
    stiff = {"solref": text(2.0 * timestep, 1.0), "solimp": text(0.9999, 0.9999, 0.001)}
    for one in robot.coupled:
        joints = {"joint1": one.joint} | ({"joint2": one.other} if one.other else {})
        coefficients = (*one.coefficients, *[0.0] * 5)[:5]
        ElementTree.SubElement(equality, "joint",
                               joints | {"polycoef": text(*coefficients)} | stiff)
    for loop in robot.loops:
        sites = {f"site{i}": f"{loop.name} {i}" for i in (1, 2)}
        for name, frame in zip(sites.values(), map(robot.frame, loop.frames), strict=True):
            R = frame.rotation
            ElementTree.SubElement(elements[frame.joint], "site", name=name,
                                   pos=text(*frame.offset), xyaxes=text(*R[:, 0], *R[:, 1]))
        ElementTree.SubElement(equality, "weld" if loop.rigid else "connect", sites | stiff)


def _axes(robot: Robot) -> dict[int, tuple[str, Array, int]]:
    """Return kind, axis (3,) in its own frame, and velocity of each joint with one velocity."""
    state, axes = State(robot), {}
    for joint in range(2 if robot.base == "floating" else 1, len(robot.parents)):
        own = np.flatnonzero(state.supports[joint] & ~state.supports[robot.parents[joint]])
        slide, turn = state.J[:3, own].sum(axis=1), state.J[3:, own].sum(axis=1)
        kind, axis = ("hinge", turn) if turn.any() else ("slide", slide)
        if len(own) != 1 or abs(np.linalg.norm(axis) - 1.0) > 1e-9:
            raise ScenarioError(f"joint {robot.joint_names[joint - 1]!r} does not turn about or "
                                "slide along one axis")
        axes[joint] = kind, state.placements[joint, :9].reshape(3, 3) @ axis, int(own[0])
    return axes
