"""Make the plant from [plant]."""

from __future__ import annotations

from typing import cast

from hierarchy import State
from hierarchy.avoidance import Obstacles
from hierarchy.contacts import Contacts
from scenarios.cell.plants import Apart, Commanded, JointSensor, Plant
from scenarios.cell.plants.plant import Driven
from scenarios.config import Scenario, ScenarioError


def plant_of(scenario: Scenario, start: State, obstacles: Obstacles,
             contacts: Contacts | None = None) -> Plant:
    """Return the plant of a robot at its start; `contacts` as in a Cell.

    Raises ScenarioError if the requested measurement is not possible for the robot's joints.
    """
    section, control, robot = scenario.plant, scenario.control, start.robot
    sensor = JointSensor(section.measurement, control.period, robot)
    plant: Plant = section.made(robot, q=start.q, v=start.v, period=control.period,
                                level=control.level, obstacles=obstacles, contacts=contacts)
    driven = hasattr(plant, "reference_q")
    if section.feedback == "measured":
        return plant if section.measurement.ideal and not driven else Apart(plant, sensor)
    if section.follows:
        return plant
    if not driven:
        raise ScenarioError(f'plant.feedback = "commanded": a plant of kind {section.kind!r} has '
                            "no reference_q and reference_v")
    return Apart(plant, Commanded(cast(Driven, plant)))
