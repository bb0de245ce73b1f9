"""Paths in space as functions of time: position, velocity and acceleration."""

from hierarchy.paths.path import Ellipse, Jittered, Path, Shifted, Still, circle
from hierarchy.paths.through import Blended, Recorded, Waypoints, line

__all__ = ["Blended", "Ellipse", "Jittered", "Path", "Recorded", "Shifted", "Still", "Waypoints",
           "circle", "line"]
