"""Make a path from its section."""

from __future__ import annotations

from hierarchy.paths import Ellipse, Jittered, Path, Still, Waypoints
from scenarios.config.sections import EllipseSection, PathSection, WaypointsSection


def make_path(section: PathSection) -> Path:
    """Return the path of a section."""
    path, jitter = _steady(section), section.jitter
    return path if jitter is None else Jittered(path, jitter.amplitude, jitter.rate, jitter.seed)


def _steady(section: PathSection) -> Path:
    if isinstance(section, EllipseSection):
        return Ellipse(section.centre, section.cosine, section.sine, section.rate)
    if isinstance(section, WaypointsSection):
        return Waypoints(section.times, section.points)
    return Still(section.position)
