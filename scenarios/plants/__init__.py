"""What the commands move."""

from scenarios.plants.kinematic import KinematicArm

__all__ = ["KinematicArm"]
