"""Paths in a scenario file: the keys of each kind, and the path that they make."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

import numpy as np

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
from scenarios.config.errors import naming
from scenarios.config.sections import (
    Angle,
    Count,
    Distance,
    Finite,
    OneOf,
    Point,
    Positive,
    Section,
    Span,
    Time,
    Unit,
    Vector3,
)


class JitterSection(Section):
    """A smooth random motion of a path."""

    amplitude: Distance
    """Largest displacement in each axis."""
    rate: Annotated[Positive, Unit("Hz")]
    """Highest frequency of the motion."""
    seed: Count = 0
    """Seed of the motion; the same one gives the same motion."""


class AnyPath(Section):
    """What every path may have."""

    of: ClassVar[Callable[..., Path]]
    jitter: JitterSection | None = None
    """A random motion that is added to the path."""
    out_of_reach: tuple[tuple[Time, Time], ...] | None = None
    """Intervals in which the robot cannot be on the path, for metrics of its return."""

    def _wrong(self) -> Iterator[str]:
        times = [t for span in self.out_of_reach or () for t in span]
        if any(b <= a for a, b in pairwise(times)):
            yield f"out_of_reach: times must increase, got {times}"

    def make(self) -> Path:
        """Return the path; raises ScenarioError where the values are no path."""
        with naming(f"path of kind {getattr(self, 'kind', '')!r}"):
            path, jitter = self._steady(), self.jitter
        return path if jitter is None else Jittered(path, jitter.amplitude, jitter.rate,
                                                    jitter.seed)

    def _steady(self) -> Path:
        """Return the path without jitter: what `of` makes of the keys of the kind, in order."""
        common = {"kind", *AnyPath.model_fields}
        return type(self).of(*(getattr(self, key) for key in type(self).model_fields
                               if key not in common))


class StillSection(AnyPath):
    """A point that does not move."""

    of: ClassVar[Callable[..., Path]] = Still
    kind: Literal["still"]
    position: Point
    """Where the point is in the world."""


class EllipseSection(AnyPath):
    """p(t) = centre + cosine cos(s) + sine sin(s), with s = rate t + phase."""

    kind: Literal["ellipse"]
    centre: Point
    """Middle of the ellipse."""
    cosine: Point
    """Half axis, from the centre to the point where s = 0."""
    sine: Point
    """Half axis, from the centre to the point where s is a quarter turn."""
    rate: Annotated[Finite, Unit("rad/s")] = 1.0
    """How fast s grows."""
    phase: Angle = 0.0
    """s at the start."""

    def _steady(self) -> Path:
        if self.phase == 0.0:
            return Ellipse(self.centre, self.cosine, self.sine, self.rate)
        cosine, sine = np.array(self.cosine), np.array(self.sine)
        c, s = np.cos(self.phase), np.sin(self.phase)  # the phase by the addition theorems
        turned = tuple((c * cosine + s * sine).tolist()), tuple((c * sine - s * cosine).tolist())
        return Ellipse(self.centre, *turned, self.rate)


class WaypointsSection(AnyPath):
    """Straight lines between points, at rest at every point."""

    kind: Literal["waypoints"]
    times: tuple[Time, ...]
    """Increasing times, one for each point."""
    points: tuple[Point, ...]
    """The points."""
    blend: Span | None = None
    """With it the path does not stop: it rounds each point in a curve of this duration and is
    nearest to it half that time later, see hierarchy.paths.Blended."""

    def _steady(self) -> Path:
        return (Waypoints(self.times, self.points) if self.blend is None
                else Blended(self.times, self.points, self.blend))


class LineSection(AnyPath):
    """Straight from one point to another, at rest at both."""

    of: ClassVar[Callable[..., Path]] = staticmethod(line)
    kind: Literal["line"]
    start: Point
    """First point."""
    end: Point
    """Last point."""
    duration: Span
    """How long the motion takes."""
    begin: Time = 0.0
    """When it begins."""


class CircleSection(AnyPath):
    """A circle."""

    of: ClassVar[Callable[..., Path]] = staticmethod(circle)
    kind: Literal["circle"]
    centre: Point
    """Middle of the circle."""
    radius: Distance
    """Its radius."""
    normal: Vector3 = (0.0, 0.0, 1.0)
    """The direction across its plane, of any length."""
    rate: Annotated[Finite, Unit("rad/s")] = 1.0
    """How fast the angle grows."""
    phase: Angle = 0.0
    """Angle at the start."""


class RecordedSection(AnyPath):
    """A recorded motion."""

    of: ClassVar[Callable[..., Path]] = Recorded.from_csv
    kind: Literal["recorded"]
    file: str
    """CSV with the columns t [s], x, y, z [m]; relative to the scenario's file."""


PathSection = Annotated[StillSection | LineSection | CircleSection | EllipseSection
                        | WaypointsSection | RecordedSection, OneOf()]
