"""Make the plant from [plant]."""

from __future__ import annotations

from typing import cast

from hierarchy import Robot
from hierarchy.avoidance import Obstacles
from hierarchy.contacts import Contacts
from hierarchy.problem import Array
from scenarios.cell.plants import (
    Apart,
    Commanded,
    JointSensor,
    KinematicArm,
    PhysicsArm,
    Plant,
    TorqueRobot,
)
from scenarios.cell.plants.plant import Driven
from scenarios.config import Scenario, ScenarioError
from scenarios.config.plant import OwnPlant, PhysicsSection, TorqueSection


def plant_of(scenario: Scenario, robot: Robot, start: tuple[Array, Array],
             obstacles: Obstacles, contacts: Contacts | None = None) -> Plant:
    """Return the plant of a robot that starts at q (nq,) and v (n,); `contacts` as in a Cell.

    Raises ScenarioError if the requested measurement is not possible for the robot's joints.
    """
    section, control, (q, v) = scenario.plant, scenario.control, start
    sensor = JointSensor(section.measurement, control.period, robot)
    if isinstance(section, OwnPlant):
        own = section.made(robot, q=q, v=v, period=control.period, level=control.level,
                       obstacles=obstacles)
        return own if _unmeasured(section) else Apart(own, _feedback(section, own, sensor))
    if isinstance(section, TorqueSection):
        assert contacts is not None, "the level of the scenario was checked"
        body = TorqueRobot(robot, contacts, q, v, control.period, section)
        return body if section.measurement.ideal else Apart(body, sensor)
    if isinstance(section, PhysicsSection):
        arm = PhysicsArm(robot, q, v, control.period, control.level, obstacles, section)
        return Apart(arm, Commanded(arm) if section.feedback == "commanded" else sensor)
    exact = KinematicArm(robot, q, v, control.period, control.level)
    ideal = section.measurement.ideal or section.feedback == "commanded"
    return exact if ideal else Apart(exact, sensor)


def _unmeasured(section: OwnPlant) -> bool:
    return section.measurement.ideal and section.feedback == "measured"


def _feedback(section: OwnPlant, plant: Plant, sensor: JointSensor) -> JointSensor | Commanded:
    if section.feedback == "measured":
        return sensor
    if not hasattr(plant, "reference_q"):
        raise ScenarioError(f'plant.feedback = "commanded": a plant of kind {section.kind!r} has '
                            "no reference_q and reference_v")
    return Commanded(cast(Driven, plant))
