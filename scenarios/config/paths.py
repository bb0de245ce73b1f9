"""Paths in a scenario file: the keys of each kind, and the path that they make."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import model_validator

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
    """A smooth random motion of a path: at most `amplitude` [m] in each axis, up to `rate` [Hz].

    The same `seed` gives the same motion.
    """

    amplitude: Distance
    rate: Annotated[Positive, Unit("Hz")]
    seed: Count = 0


class _AnyPath(Section):
    """What every path may have.

    `out_of_reach`: spans of time [s] in which the robot cannot be on the path. The loop ignores
    them; metrics say how the robot comes back.
    """

    of: ClassVar[Callable[..., Path]]
    jitter: JitterSection | None = None
    out_of_reach: tuple[tuple[Time, Time], ...] | None = None

    @model_validator(mode="after")
    def _spans_are_in_order(self) -> Self:
        times = [t for span in self.out_of_reach or () for t in span]
        if any(b <= a for a, b in pairwise(times)):
            raise ValueError(f"out_of_reach: times must increase, got {times}")
        return self

    def make(self) -> Path:
        """Return the path; raises ScenarioError where the values are no path."""
        with naming(f"path of kind {getattr(self, 'kind', '')!r}"):
            path, jitter = self._steady(), self.jitter
        return path if jitter is None else Jittered(path, jitter.amplitude, jitter.rate,
                                                    jitter.seed)

    def _steady(self) -> Path:
        """Return the path without jitter: what `of` makes of the keys of the kind, in order."""
        common = {"kind", *_AnyPath.model_fields}
        return type(self).of(*(getattr(self, key) for key in type(self).model_fields
                               if key not in common))


class StillSection(_AnyPath):
    """A point that does not move, `position` [m]."""

    of: ClassVar[Callable[..., Path]] = Still
    kind: Literal["still"]
    position: Point


class EllipseSection(_AnyPath):
    """p(t) = centre + cosine cos(s) + sine sin(s) [m] with s = rate t + phase [rad]."""

    kind: Literal["ellipse"]
    centre: Point
    cosine: Point
    sine: Point
    rate: Annotated[Finite, Unit("rad/s")] = 1.0
    phase: Angle = 0.0

    def _steady(self) -> Path:
        if self.phase == 0.0:
            return Ellipse(self.centre, self.cosine, self.sine, self.rate)
        cosine, sine = np.array(self.cosine), np.array(self.sine)
        c, s = np.cos(self.phase), np.sin(self.phase)  # the phase by the addition theorems
        turned = tuple((c * cosine + s * sine).tolist()), tuple((c * sine - s * cosine).tolist())
        return Ellipse(self.centre, *turned, self.rate)


class WaypointsSection(_AnyPath):
    """Points [m] at increasing times [s], at rest at each point.

    With `blend` [s] it does not stop: it rounds each point in a curve of that duration and is
    nearest to it half that time later, see hierarchy.paths.Blended.
    """

    kind: Literal["waypoints"]
    times: tuple[Time, ...]
    points: tuple[Point, ...]
    blend: Span | None = None

    def _steady(self) -> Path:
        return (Waypoints(self.times, self.points) if self.blend is None
                else Blended(self.times, self.points, self.blend))


class LineSection(_AnyPath):
    """Straight from `start` to `end` [m] within `duration` [s], from `begin` [s] on."""

    of: ClassVar[Callable[..., Path]] = staticmethod(line)
    kind: Literal["line"]
    start: Point
    end: Point
    duration: Span
    begin: Time = 0.0


class CircleSection(_AnyPath):
    """A circle of `radius` [m] about `normal`; rate [rad/s], phase [rad]."""

    of: ClassVar[Callable[..., Path]] = staticmethod(circle)
    kind: Literal["circle"]
    centre: Point
    radius: Distance
    normal: Vector3 = (0.0, 0.0, 1.0)
    rate: Annotated[Finite, Unit("rad/s")] = 1.0
    phase: Angle = 0.0


class RecordedSection(_AnyPath):
    """A recorded motion: a CSV `file` with t [s], x, y, z [m], relative to the scenario's file."""

    of: ClassVar[Callable[..., Path]] = Recorded.from_csv
    kind: Literal["recorded"]
    file: str


PathSection = Annotated[StillSection | LineSection | CircleSection | EllipseSection
                        | WaypointsSection | RecordedSection, OneOf()]
