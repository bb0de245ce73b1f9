"""Make contacts and the tasks of contact forces from [[contacts]], [forces] and [[tasks]]."""

from __future__ import annotations

from math import inf

import numpy as np

from hierarchy import HierarchyError, Robot, Task
from hierarchy.contacts import Contact, Contacts, corners
from hierarchy.tasks import (
    BaseDynamics,
    CentreOfPressure,
    ContactMotion,
    Friction,
    Together,
    TorqueLimits,
)
from scenarios.config import Scenario, ScenarioError
from scenarios.config.contacts import ContactSection


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
    points = np.array(section.offset) + corners(section.x, section.y, section.up)
    return Contact(frame, points.tolist(), section.friction, section.normal, section.name or "",
                   section.open, section.ramp, up=section.up)


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
