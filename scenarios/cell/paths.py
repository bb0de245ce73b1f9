"""From the keys of a path to the path."""

from __future__ import annotations

from hierarchy.paths import Ellipse, Path, Still, Waypoints
from scenarios.config.sections import EllipseSection, PathSection, WaypointsSection


def make_path(section: PathSection) -> Path:
    """Make the path that a section describes."""
    if isinstance(section, EllipseSection):
        return Ellipse(section.centre, section.cosine, section.sine, section.rate)
    if isinstance(section, WaypointsSection):
        return Waypoints(section.times, section.points)
    return Still(section.position)
