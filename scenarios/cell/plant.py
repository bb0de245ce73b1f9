"""Make the plant from [plant]."""

from __future__ import annotations

from hierarchy import Robot
from hierarchy.avoidance import Obstacles
from hierarchy.problem import Array
from scenarios.cell.plants import Apart, Commanded, JointSensor, KinematicArm, PhysicsArm, Plant
from scenarios.config import Scenario, ScenarioError


def plant_of(scenario: Scenario, robot: Robot, start: tuple[Array, Array],
             obstacles: Obstacles) -> Plant:
    """Return the plant of a robot that starts at q (nq,) and v (n,).

    Raises ScenarioError if the requested measurement is not possible for the robot's joints.
    """
    section, control, (q, v) = scenario.plant, scenario.control, start
    if not section.measurement.ideal and robot.nq != robot.n:
        raise ScenarioError(f"plant.measurement: robot {robot.name!r} has joints with more "
                            "coordinates than velocities, which support no noise, steps or delay")
    sensor = JointSensor(section.measurement, control.period)
    if section.kind == "mujoco":
        arm = PhysicsArm(robot, q, v, control.period, control.level, obstacles, section.servo,
                         section.joints)
        return Apart(arm, Commanded(arm) if section.feedback == "commanded" else sensor)
    exact = KinematicArm(robot, q, v, control.period, control.level)
    ideal = section.measurement.ideal or section.feedback == "commanded"
    return exact if ideal else Apart(exact, sensor)
