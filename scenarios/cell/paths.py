"""Make a path from its section."""

from __future__ import annotations

import numpy as np

from hierarchy import HierarchyError
from hierarchy.paths import (
    Blended,
    Ellipse,
    Jittered,
    Path,
    Recorded,
    Still,
    Waypoints,
    circle,
    line,
)
from scenarios.config import ScenarioError
from scenarios.config.sections import (
    CircleSection,
    EllipseSection,
    LineSection,
    PathSection,
    RecordedSection,
    WaypointsSection,
)


def make_path(section: PathSection) -> Path:
    """Return the path of a section; raises ScenarioError where its values are no path."""
    try:
        path, jitter = _steady(section), section.jitter
    except HierarchyError as error:
        raise ScenarioError(f"path of kind {section.kind!r}: {error}") from error
    return path if jitter is None else Jittered(path, jitter.amplitude, jitter.rate, jitter.seed)


def _steady(section: PathSection) -> Path:
    if isinstance(section, EllipseSection):
        return _ellipse(section)
    if isinstance(section, WaypointsSection):
        return (Waypoints(section.times, section.points) if section.blend is None
                else Blended(section.times, section.points, section.blend))
    if isinstance(section, LineSection):
        return line(section.start, section.end, section.duration, section.begin)
    if isinstance(section, CircleSection):
        return circle(section.centre, section.radius, section.normal, section.rate, section.phase)
    if isinstance(section, RecordedSection):
        return Recorded.from_csv(section.file)
    return Still(section.position)


def _ellipse(section: EllipseSection) -> Ellipse:
    """Return the ellipse with its phase in the vectors, by the addition theorems."""
    if section.phase == 0.0:
        return Ellipse(section.centre, section.cosine, section.sine, section.rate)
    cosine, sine = np.array(section.cosine), np.array(section.sine)
    c, s = np.cos(section.phase), np.sin(section.phase)
    turned = tuple((c * cosine + s * sine).tolist()), tuple((c * sine - s * cosine).tolist())
    return Ellipse(section.centre, *turned, section.rate)
