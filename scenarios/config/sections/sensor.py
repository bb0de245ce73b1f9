"""The keys of [sensor]: what every kind has, and the kinds.

All but the exact one see obstacles in depth images: a simulated camera, or recorded frames.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hierarchy.plugins import Group, register
from hierarchy.problem import Array
from scenarios.config import sections as keys
from scenarios.config.sections.own import OwnSection, PartSection

FOOT = 0.31  # [m] height of the column that a robot without floor stands on
Pixels = Annotated[int, Field(strict=True, ge=1, le=8192), keys.Unit("px")]
Focal = Annotated[keys.Positive, keys.Unit("px")]
Middle = Annotated[keys.Finite, keys.Unit("px")]


class AnySensor(PartSection):
    """What every sensor has: the height `foot` [m] of the column that its robot stands on."""

    has_frames: ClassVar[bool] = True    # that a fault may leave out
    is_recorded: ClassVar[bool] = False  # whether it shows no obstacle of the scenario
    kind: str  #: Which kind it is.
    if TYPE_CHECKING:
        foot: ClassVar[float]


@register("sensors", "exact", shipped=True)
class ExactSection(AnySensor):
    """Exact distances."""

    foot: ClassVar[float] = FOOT
    has_frames: ClassVar[bool] = False
    kind: str = "exact"

    def made(self, robot: Any, **given: Any) -> Any:
        """Return the exact sensor, which is given."""
        return given["exact"]


class ImageSection(AnySensor):
    """What sources of depth images have; see scenarios.cell.sensors.depth_sensor."""

    made_by: ClassVar[str] = "scenarios.cell.sensors.depth_sensor:depth_sensor"
    latency: keys.Time = 0.0  #: Age of a frame when it arrives.
    stale_after: keys.Time = 0.2  #: Time without frames after which `control.policy.stale` applies.
    least_readings: keys.Share = 0.1  #: Least share of valid pixels.
    foot: keys.Distance = FOOT  # type: ignore[misc]
    """Height of the column below the base, removed from images."""
    margin: keys.Distance = 0.05  #: Width around the robot's capsules in which pixels are removed.
    region: keys.Length | None = None
    """Distance from control points within which obstacles are seen; by default that within which
    avoidance acts."""
    thin: keys.Distance | None = None
    """Obstacles' depth behind their surface, by default infinite."""
    support: Annotated[int, Field(strict=True, ge=1, le=9)] = 3  #: Pixels of nine that must agree.
    band: keys.Distance = 0.05  #: Difference in depth within which they do.


@register("sensors", "camera", shipped=True)
class CameraSection(ImageSection):
    """A simulated depth camera; the defaults resemble a Kinect."""

    noise_floor: keys.Distance = 1.2e-3
    """Standard deviation of the noise of z at `noise_from`, clipped at 3.5 of them."""
    noise_growth: keys.NotNegative = 1.9e-3  #: Its growth with (z - noise_from)^2 [1/m].
    noise_from: keys.Distance = 0.4  #: Depth from which it grows.
    rounding: Literal["disparity", "step"] = "disparity"
    """Rounds z ("step") or 1 / z ("disparity") to multiples of `step`."""
    step: keys.NotNegative = 2.85e-3  #: In [m], or [1/m] of a disparity; 0 for none.
    near: keys.Distance = 0.5  #: Depth below which readings are missing.
    far: keys.Length = 5.0  #: Depth above which readings are missing.
    missing: keys.Share = 0.002  #: Probability of a missing reading.
    missing_at_edges: keys.Share = 0.3  #: The same beside a step in depth of 5 cm.
    outliers: keys.Share = 0.02  #: Probability of a square with a random, smaller depth in a frame.
    ideal: keys.Flag = False  #: Whether readings have no errors.
    outlier_size: keys.Count = 2  #: Largest half side of that square, in pixels.
    width: Pixels = 640  #: Columns of the image.
    height: Pixels = 480  #: Rows of the image.
    fx: Focal = 525.0  #: Focal length, horizontally.
    fy: Focal = 525.0  #: Focal length, vertically.
    cx: Middle | None = None  #: Column of the optical axis, by default the middle one.
    cy: Middle | None = None  #: Row of the optical axis, by default the middle one.
    position: keys.Point = (0.0, 2.0, 0.7)  #: Where the camera is.
    look_at: keys.Point = (0.0, 0.3, 0.1)  #: Point that it looks at.
    rotation: keys.Rows3 | None = None
    """In place of `look_at`: rows of the matrix from camera (right, down, forward) to world."""
    rate: keys.Frequency = 30.0  #: Frames per second.
    jitter: keys.Time = 0.0  #: Largest random shift of a frame; below 1 / rate.
    seed: keys.Count = 0  #: Seed of errors and jitter.
    point_radius: keys.Distance = 0.02  #: Radius at which obstacles that are points are seen.
    backdrop: keys.Distance = 4.0  #: Depth of a wall behind everything, 0 for none.

    def _wrong(self) -> Iterator[str]:
        if self.near >= self.far:
            yield f"near = {self.near} m must be below far = {self.far} m"

    @property
    def random(self) -> bool:
        """Whether readings have random errors."""
        return not self.ideal and any((self.noise_floor, self.noise_growth, self.missing,
                                       self.missing_at_edges, self.outliers))

    def packed(self) -> Array:
        """Return the array (9,) for `expose`."""
        errors = np.array([self.noise_floor, self.noise_growth, self.noise_from,
                           self.rounding == "disparity", self.step, self.missing,
                           self.missing_at_edges])
        return np.insert(errors * (not self.ideal), 5, [self.near, self.far])

    def add_outliers(self, rng: np.random.Generator, reading: NDArray[np.float32]) -> None:
        """Add this frame's outlier, if it has one, to a reading (h, w)."""
        if self.ideal or rng.random() >= self.outliers:
            return
        v, u = rng.integers(reading.shape[0]), rng.integers(reading.shape[1])
        half = int(rng.integers(self.outlier_size + 1))
        behind = float(reading[v, u]) or self.far
        reading[max(v - half, 0):v + half + 1, max(u - half, 0):u + half + 1] = (
            rng.uniform(self.near, behind) if np.isfinite(behind) else self.near)


@register("sensors", "frames", shipped=True)
class FramesSection(ImageSection):
    """Recorded depth images, with their camera and times."""

    is_recorded: ClassVar[bool] = True
    folder: str  #: Their folder, relative to the scenario's file, or a shipped set.


class FrameSection(keys.Section):
    """One of the images of a `FramesFile`."""

    file: str  #: A 16-bit PNG file, in which 0 means no reading.
    time: keys.Finite  #: When it was taken [s].
    q: tuple[keys.Finite, ...] | None = None  #: The robot's joints then [rad or m].


class FramesFile(keys.Section):
    """What recorded images say of their camera, and of each."""

    width: Pixels  #: As of a `CameraSection`, and so on.
    height: Pixels
    fx: Focal
    fy: Focal
    cx: Middle | None = None
    cy: Middle | None = None
    position: keys.Point
    rotation: keys.Rows3  #: Its columns are the camera's axes in the world.
    scale: keys.Length = 1e-3  #: Depth of one step of a pixel.
    frame: Annotated[tuple[FrameSection, ...], Field(min_length=1)]

    def _wrong(self) -> Iterator[str]:
        if any(a.time >= b.time for a, b in pairwise(self.frame)):
            yield "the times of the frames must increase"


class OwnSensor(AnySensor, OwnSection):
    """A sensor of a plug-in, with its keys."""

    group: ClassVar[Group] = "sensors"
    foot: ClassVar[float] = FOOT


SensorKind = Annotated[AnySensor, keys.OneOf("exact", OwnSensor)]
