"""Make contacts from [[contacts]], and check that they stand on the plant's floor at the start.

The controller plans forces at every point of a closed contact from the first tick on. A point 2 mm
above the floor takes 20 ms to come down, while contacts that stand give way by 0.1 mm; until then
the robot does not do what was planned.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hierarchy import Robot, State
from hierarchy.contacts import Contact, Contacts, corners
from hierarchy.problem import Array
from scenarios.cell.plants.ground import BALL
from scenarios.config import Scenario, ScenarioError
from scenarios.config.contacts import ContactSection
from scenarios.config.errors import naming
from scenarios.config.kinds.torque import TorqueSection

_OFF = 0.002      # [m] of a point from the floor that is too far
_TILTED = 1.0     # [deg] of a sole from the floor that is too much
_ON_EDGE, _TURNED_OVER = 45.0, 135.0  # [deg] from which another plane of its frame must be meant


def contacts_of(scenario: Scenario, robot: Robot) -> Contacts | None:
    """Return the contacts at level "torque", None at the others; raises ScenarioError."""
    if scenario.control.level != "torque":
        return None
    contacts = []
    for i, section in enumerate(scenario.contacts):
        with naming(f"contacts.{i}"):
            contacts.append(_contact(section, robot))
    with naming("contacts"):
        return Contacts(robot, contacts)


def _contact(section: ContactSection, robot: Robot) -> Contact:
    with naming("frame"):
        frame = robot.frame(section.frame)
    if section.x is None or section.y is None:
        return Contact(frame, (section.offset,), section.friction, section.normal,
                       section.name or "", section.open, section.ramp, section.slides)
    points = np.array(section.offset) + corners(section.x, section.y, section.up)
    return Contact(frame, points.tolist(), section.friction, section.normal, section.name or "",
                   section.open, section.ramp, up=section.up)


def on_contacts(scenario: Scenario, start: State) -> tuple[State, Contacts | None]:
    """Return the start on its contacts, and those; see `contacts_of`.

    With start.on_floor the base is raised or lowered so that the lowest contact touches the floor.
    Raises a ScenarioError for a fixed base then, or for a contact that does not stand on the
    plant's floor. One that is open at the start may be anywhere, one that slides above the floor.
    """
    contacts = contacts_of(scenario, start.robot)
    if contacts is None:
        return start, None
    plant = scenario.plant
    floor = plant.height if isinstance(plant, TorqueSection) else 0.0
    if scenario.start.on_floor:
        start = _lowered(contacts, start, floor)
    if isinstance(plant, TorqueSection) and (found := list(_astray(contacts, start, floor))):
        raise ScenarioError(min(found)[1])
    return start, contacts


def _lowered(contacts: Contacts, start: State, floor: float) -> State:
    if contacts.robot.base != "floating" or not contacts.contacts:
        raise ScenarioError("start.on_floor needs a floating base and [[contacts]]")
    q = start.q.copy()
    q[2] += floor - min(_heights(contact, start).min() for contact in contacts.contacts)
    return State.at(contacts.robot, q, start.v)


def _astray(contacts: Contacts, start: State, floor: float) -> Iterator[tuple[float, str]]:
    """Yield how far contacts are from the floor, the farthest least, and how they stand there."""
    for i, contact in enumerate(contacts.contacts):
        above = _heights(contact, start) - floor
        waits = contact.load(0.0) == 0.0 or (contact.slides and above[0] > 0.0)
        if not waits and (wrong := _wrong(contact, above, start.rotation(contact.frame))):
            yield -np.abs(above).max(), f"contacts.{i}: at the start {wrong}"


def doubts(scenario: Scenario, contacts: Contacts) -> Iterator[str]:
    """Yield what the controller assumes of the floor and the plant's floor lacks."""
    if not isinstance(scenario.plant, TorqueSection):
        return
    for contact in contacts.contacts:
        if scenario.plant.friction < contact.friction:
            yield (f"contact {contact.name!r}: the controller counts on a friction of "
                   f"{contact.friction:g}, and the plant has {scenario.plant.friction:g} "
                   "(plant.friction): it may slip")
        if (angle := _from_vertical(contact.axes[2])) > _TILTED:
            yield (f"contact {contact.name!r}: its normal is {angle:.3g} deg from vertical, and "
                   "the plant's floor is horizontal")


def _wrong(contact: Contact, above: Array, rotation: Array) -> str | None:
    """Return why a contact with points `above` (k,) [m] the floor does not stand, and a remedy."""
    k, angle = int(np.abs(above).argmax()), _from_vertical(rotation @ contact.sole[2])
    gap = f"{1e3 * abs(above[k]):.3g} mm {'above' if above[k] > 0.0 else 'below'} the floor"
    if contact.is_surface and angle > _ON_EDGE:
        up = ", ".join(f"{value:g}" for value in np.round(rotation[2], 3) + 0.0)
        turned = "turned on edge" if angle < _TURNED_OVER else "upside down"
        return (f"the sole of {contact.name!r} is {turned}, {angle:.0f} deg from the floor. It is "
                f"across `up` in its frame, where the vertical is [{up}] here: set `up`, or take "
                "another frame")
    if contact.is_surface and (angle > _TILTED or np.ptp(above) > _OFF):
        corner = ", ".join(f"{value:g}" for value in contact.points[k])
        return (f"the sole of {contact.name!r} is not flat on the floor but tilted by {angle:.3g} "
                f"deg; its corner ({corner}) is {gap}. Turn it with start.joints")
    if abs(above[k]) > _OFF:
        return (f"{contact.name!r} is {gap}. start.on_floor brings the lowest contact of a "
                "floating base to the floor, start.joints and plant.height others; one that is to "
                "come down later is `open`")
    return None


def _heights(contact: Contact, state: State) -> Array:
    """Return the height (k,) [m] of the lowest place of each point, which is a ball if alone."""
    points = np.array(contact.points, dtype=float) @ state.rotation(contact.frame).T
    heights: Array = (state.position(contact.frame) + points)[:, 2]
    return heights if contact.is_surface else heights - BALL


def _from_vertical(direction: Array) -> float:
    """Return the angle [deg] of a unit vector (3,) from the world's z axis."""
    return float(np.degrees(np.arctan2(np.hypot(direction[0], direction[1]), direction[2])))
