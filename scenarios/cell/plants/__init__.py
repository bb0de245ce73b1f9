"""Plants: the simulated robots that commands move."""

from scenarios.cell.plants.physics import PhysicsArm
from scenarios.cell.plants.plant import Apart, JointSensor, KinematicArm, Plant
from scenarios.cell.plants.torque import TorqueRobot

__all__ = ["Apart", "JointSensor", "KinematicArm", "PhysicsArm", "Plant", "TorqueRobot"]
