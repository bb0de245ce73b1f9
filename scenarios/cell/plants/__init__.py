"""Plants: the simulated robots that commands move."""

from scenarios.cell.plants.kinematic import KinematicArm
from scenarios.cell.plants.physics import PhysicsArm
from scenarios.cell.plants.plant import Apart, Commanded, JointSensor, Plant
from scenarios.cell.plants.torque import TorqueRobot

__all__ = ["Apart", "Commanded", "JointSensor", "KinematicArm", "PhysicsArm", "Plant",
           "TorqueRobot"]
