"""Make contacts and the tasks of contact forces from [[contacts]], [forces] and [[tasks]]."""

from __future__ import annotations

from math import inf

import numpy as np

from hierarchy import HierarchyError, Robot, State, Task
from hierarchy.contacts import Contact, Contacts
from hierarchy.problem import Array
from hierarchy.tasks import (
    BaseDynamics,
    CentreOfPressure,
    ContactForce,
    ContactMotion,
    Friction,
    LeastForce,
    Together,
    TorqueLimits,
)
from scenarios.cell.plants.ground import BALL
from scenarios.config import Scenario, ScenarioError
from scenarios.config.contacts import ContactSection
from scenarios.config.listed import ListedForce, ListedLeastForce


def contacts_of(scenario: Scenario, robot: Robot) -> Contacts | None:
    """Return the contacts at level "torque", None at the others; raises ScenarioError."""
    if scenario.control.level != "torque":
        return None
    try:
        return Contacts(robot, [_contact(section, robot) for section in scenario.contacts])
    except HierarchyError as error:
        raise ScenarioError(f"contacts: {error}") from error


def _contact(section: ContactSection, robot: Robot) -> Contact:
    frame = robot.frame(section.frame)
    if section.x is None or section.y is None:
        return Contact(frame, (section.offset,), section.friction, section.normal,
                       section.name or "", section.open, section.ramp, section.slides)
    (back, front), (right, left), (x, y, z) = section.x, section.y, section.offset
    corners = [(x + along, y + across, z) for along, across in (
        (back, right), (front, right), (front, left), (back, left))]
    return Contact(frame, corners, section.friction, section.normal, section.name or "",
                   section.open, section.ramp)


def physics_of(scenario: Scenario, contacts: Contacts) -> list[Task]:
    """Return the levels at the top of a stack at level "torque".

    "physics" has the equations of motion of a floating base and the contacts at rest, "limits" the
    torque limits and the forces that contacts can transmit. One that would be empty is left out.
    """
    try:
        motion = [ContactMotion(contacts, damping=scenario.forces.damping)] \
            if contacts.contacts else []
        dynamics = [BaseDynamics(contacts)] if contacts.robot.base == "floating" else []
        limits = _limits(scenario, contacts) if scenario.forces_in_stack else []
    except HierarchyError as error:
        raise ScenarioError(f"forces: {error}") from error
    return [Together(tasks, name) for tasks, name in (
        ([*dynamics, *motion], "physics"), (limits, "limits")) if tasks]


def _limits(scenario: Scenario, contacts: Contacts) -> list[Task]:
    limits, forces = scenario.limits, scenario.forces
    found: list[Task] = []
    if limits and (limits.torque or limits.torque_step):
        found.append(TorqueLimits(contacts.robot, limits.torque or 1.0, contacts=contacts,
                                  step=limits.torque_step or inf))
    if contacts.contacts:
        found.append(Friction(contacts, forces.faces, forces.least, forces.largest or inf))
    if forces.edge is not None:
        found.append(CentreOfPressure(contacts, forces.edge))
    return found


def standing_on(floor: float, contacts: Contacts, q: Array) -> Array:
    """Return q (nq,) with the base at the height that brings the lowest contact to `floor` [m].

    Raises ScenarioError for a fixed base, or without contacts.
    """
    if contacts.robot.base != "floating" or not contacts.contacts:
        raise ScenarioError("start.on_floor needs a floating base and [[contacts]]")
    state, q = State.at(contacts.robot, q), q.copy()
    lowest = min(
        (state.position(contact.frame) + state.rotation(contact.frame) @ np.array(point))[2]
        - (0.0 if contact.is_surface else BALL)
        for contact in contacts.contacts for point in contact.points)
    q[2] += floor - lowest
    return q


def force_task(section: ListedForce | ListedLeastForce, contacts: Contacts) -> Task:
    """Return a listed task of contact forces; raises ScenarioError, naming the task."""
    try:
        if isinstance(section, ListedForce):
            return ContactForce(contacts, section.contact, section.target, section.title)
        return LeastForce(contacts, section.title)
    except HierarchyError as error:
        raise ScenarioError(f"task {section.title!r}: {error}") from error
