"""What the commands move."""

from scenarios.plants.kinematic import KinematicArm
from scenarios.plants.measured import Apart, Commanded, JointSensor
from scenarios.plants.physics import PhysicsArm
from scenarios.plants.plant import Plant

__all__ = ["Apart", "Commanded", "JointSensor", "KinematicArm", "PhysicsArm", "Plant"]
