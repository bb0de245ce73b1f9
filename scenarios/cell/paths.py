"""Make a path from its section."""

from __future__ import annotations

import numpy as np

from hierarchy.paths import Ellipse, Jittered, Path, Still, Waypoints
from scenarios.config.sections import EllipseSection, PathSection, WaypointsSection


def make_path(section: PathSection) -> Path:
    """Return the path of a section."""
    path, jitter = _steady(section), section.jitter
    return path if jitter is None else Jittered(path, jitter.amplitude, jitter.rate, jitter.seed)


def _steady(section: PathSection) -> Path:
    if isinstance(section, EllipseSection):
        return _ellipse(section)
    if isinstance(section, WaypointsSection):
        return Waypoints(section.times, section.points)
    return Still(section.position)


def _ellipse(section: EllipseSection) -> Ellipse:
    """Return the ellipse with its phase in the vectors, by the addition theorems."""
    if section.phase == 0.0:
        return Ellipse(section.centre, section.cosine, section.sine, section.rate)
    cosine, sine = np.array(section.cosine), np.array(section.sine)
    c, s = np.cos(section.phase), np.sin(section.phase)
    turned = tuple((c * cosine + s * sine).tolist()), tuple((c * sine - s * cosine).tolist())
    return Ellipse(section.centre, *turned, section.rate)
