"""Paths in a scenario file: the keys of each kind, and the path that they make."""

from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

import numpy as np

from hierarchy import paths
from scenarios.config import sections as keys
from scenarios.config.sections import naming


class JitterSection(keys.Section):
    """A smooth random motion."""

    amplitude: keys.Distance  #: Largest displacement in each axis.
    rate: keys.Frequency  #: Highest frequency of the motion.
    seed: keys.Count = 0  #: Seed of the motion.


class AnyPath(keys.Section):
    """What every path may have."""

    of: ClassVar[Callable[..., paths.Path]]
    jitter: JitterSection | None = None  #: A random motion added to the path.
    out_of_reach: tuple[tuple[keys.Time, keys.Time], ...] | None = None
    """Intervals when the path is out of reach, for metrics of the return."""

    def _wrong(self) -> Iterator[str]:
        times = [t for span in self.out_of_reach or () for t in span]
        if any(b <= a for a, b in pairwise(times)):
            yield f"out_of_reach: times must increase, got {times}"

    def make(self) -> paths.Path:
        """Return the path; raises ScenarioError where the values are no path."""
        with naming(f"path of kind {getattr(self, 'kind', '')!r}"):
            path, jitter = self._steady(), self.jitter
        return path if jitter is None else paths.Jittered(
            path, jitter.amplitude, jitter.rate, jitter.seed)

    def _steady(self) -> paths.Path:
        """Return the path without jitter: what `of` makes of the keys of the kind, in order."""
        common = {"kind", *AnyPath.model_fields}
        return type(self).of(*(getattr(self, key) for key in type(self).model_fields
                               if key not in common))


class StillSection(AnyPath):
    """A point that does not move."""

    of: ClassVar[Callable[..., paths.Path]] = paths.Still
    kind: Literal["still"]
    position: keys.Point  #: Where the point is in the world.


class EllipseSection(AnyPath):
    """centre + cosine cos(s) + sine sin(s) with s = rate t + phase."""

    kind: Literal["ellipse"]
    centre: keys.Point  #: Middle of the ellipse.
    cosine: keys.Point  #: Half axis.
    sine: keys.Point  #: The other half axis.
    rate: keys.AngularRate = 1.0  #: How fast s grows.
    phase: keys.Angle = 0.0  #: s at the start.

    def _steady(self) -> paths.Path:
        cosine, sine = np.array(self.cosine), np.array(self.sine)
        c, s = np.cos(self.phase), np.sin(self.phase)  # the phase by the addition theorems
        turned = tuple((c * cosine + s * sine).tolist()), tuple((c * sine - s * cosine).tolist())
        return paths.Ellipse(self.centre, *turned, self.rate)


class WaypointsSection(AnyPath):
    """Straight lines, at rest at every point."""

    kind: Literal["waypoints"]
    times: tuple[keys.Time, ...]  #: A time for each point.
    points: tuple[keys.Point, ...]  #: The points.
    blend: keys.Span | None = None
    """Rounds each point in a curve of this duration, and passes it half that time later."""

    def _wrong(self) -> Iterator[str]:
        self._steady()  # raises, for points and times that do not fit
        yield from super()._wrong()

    def _steady(self) -> paths.Path:
        return (paths.Waypoints(self.times, self.points) if self.blend is None
                else paths.Blended(self.times, self.points, self.blend))


class LineSection(AnyPath):
    """Straight from rest to rest."""

    of: ClassVar[Callable[..., paths.Path]] = staticmethod(paths.line)
    kind: Literal["line"]
    start: keys.Point  #: First point.
    end: keys.Point  #: Last point.
    duration: keys.Span  #: How long the motion takes.
    begin: keys.Time = 0.0  #: When it begins.


class CircleSection(AnyPath):
    """A circle."""

    of: ClassVar[Callable[..., paths.Path]] = staticmethod(paths.circle)
    kind: Literal["circle"]
    centre: keys.Point  #: Middle of the circle.
    radius: keys.Distance  #: Its radius.
    normal: keys.Vector3 = (0.0, 0.0, 1.0)  #: Normal of its plane.
    rate: keys.AngularRate = 1.0  #: How fast the angle grows.
    phase: keys.Angle = 0.0  #: Angle at the start.


class RecordedSection(AnyPath):
    """A recorded motion."""

    of: ClassVar[Callable[..., paths.Path]] = paths.Recorded.from_csv
    kind: Literal["recorded"]
    file: str  #: CSV with columns t [s], x, y, z [m], relative to the scenario's file.


PathSection = Annotated[StillSection | LineSection | CircleSection | EllipseSection
                        | WaypointsSection | RecordedSection, keys.OneOf()]
