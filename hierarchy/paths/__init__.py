"""Paths in space as functions of time: position, velocity and acceleration."""

from hierarchy.paths.bvh import Motion, read_bvh
from hierarchy.paths.path import (
           Blended,
           Ellipse,
           Jittered,
           Path,
           Recorded,
           Shifted,
           Still,
           Waypoints,
           circle,
           line,
)

__all__ = ["Blended", "Ellipse", "Jittered", "Motion", "Path", "Recorded", "Shifted", "Still",
           "Waypoints", "circle", "line", "read_bvh"]
