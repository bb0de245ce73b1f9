"""The keys of [sensor]: what every kind has, and the kinds.

All but the exact one see obstacles in depth images: a simulated camera, or recorded frames.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from hierarchy.plugins import Group, register
from hierarchy.problem import Array
from scenarios.config.own import OwnSection, PartSection
from scenarios.config.sections import (
    Count,
    Distance,
    Finite,
    Flag,
    Length,
    NotNegative,
    Point,
    Positive,
    Registered,
    Rows3,
    Section,
    Share,
    Time,
    Unit,
)

FOOT = 0.31  # [m] height of the column that a robot without floor stands on
Pixels = Annotated[int, Field(strict=True, ge=1, le=8192), Unit("px")]
WIDEST = 3.5  # [standard deviations] at which noise is clipped, so that it is bounded


class AnySensor(PartSection):
    """What every sensor has: the height `foot` [m] of the column that its robot stands on."""

    has_frames: ClassVar[bool] = True    # that a fault may leave out
    is_recorded: ClassVar[bool] = False  # whether it shows no obstacle of the scenario
    kind: str
    """Which kind it is."""
    if TYPE_CHECKING:
        foot: ClassVar[float]


@register("sensors", "exact", shipped=True)
class ExactSection(AnySensor):
    """Distances of the known geometry, without errors."""

    foot: ClassVar[float] = FOOT
    has_frames: ClassVar[bool] = False
    kind: Literal["exact"] = "exact"

    def made(self, robot: Any, **given: Any) -> Any:
        """Return the exact sensor, which is given."""
        return given["exact"]


class ImageSection(AnySensor):
    """What sources of depth images have; see scenarios.cell.sensors.depth_sensor."""

    made_by: ClassVar[str] = "scenarios.cell.sensors.depth_sensor:depth_sensor"
    latency: Time = 0.0
    """Time from taking a frame until it is available."""
    stale_after: Time = 0.2
    """Time without a new frame after which the camera is blind and `control.policy.stale`
    applies."""
    least_readings: Share = 0.1
    """Share of valid pixels below which a frame does not count."""
    foot: Distance = FOOT  # type: ignore[misc]
    """Height of the column below the base that is removed from the image with the robot's
    capsules."""
    margin: Distance = 0.05
    """Width around the capsules within which pixels are removed with the robot."""
    region: Length | None = None
    """Distance from a point within which obstacles are seen; by default the largest at which
    avoidance acts."""
    thin: Distance | None = None
    """How far obstacles extend behind their surface; by default without bound."""
    support: Annotated[int, Field(strict=True, ge=1, le=9)] = 3
    """Pixels of the nine around one that must agree for it to count."""
    band: Distance = 0.05
    """Difference in depth up to which pixels agree."""


class DepthErrors(Section):
    """Errors of a depth reading z of a simulated camera; the defaults resemble a Kinect."""

    noise_floor: Distance = 1.2e-3
    """Standard deviation of the normal noise of z at `noise_from`, clipped at 3.5 times that."""
    noise_growth: NotNegative = 1.9e-3
    """Growth of that deviation with (z - noise_from)^2 [1/m]."""
    noise_from: Distance = 0.4
    """Depth from which noise grows."""
    rounding: Literal["disparity", "step"] = "disparity"
    """"step" rounds z to multiples of `step`, "disparity" 1 / z, as a triangulating camera does."""
    step: NotNegative = 2.85e-3
    """Step of the rounding, in [m], or [1/m] of a disparity; 0 for none."""
    near: Distance = 0.5
    """Depth below which readings are missing."""
    far: Annotated[float, Field(strict=True, gt=0.0), Unit("m")] = 5.0
    """Depth above which readings are missing."""
    missing: Share = 0.002
    """Probability of a missing reading."""
    missing_at_edges: Share = 0.3
    """The same where a neighbour is 5 cm nearer or farther."""
    outliers: Share = 0.02
    """Probability that a frame has a square with a random depth before the true one."""
    outlier_size: Count = 2
    """Largest number of pixels from the middle of that square to its side."""

    def _wrong(self) -> Iterator[str]:
        if self.near >= self.far:
            yield f"near = {self.near} m must be below far = {self.far} m"

    @classmethod
    def none(cls, near: float = 0.0, far: float = inf) -> DepthErrors:
        """Return the errors of an ideal camera: exact readings between near and far [m]."""
        return DepthErrors(noise_floor=0.0, noise_growth=0.0, noise_from=0.0, rounding="step",
                           step=0.0, near=near, far=far, missing=0.0, missing_at_edges=0.0,
                           outliers=0.0, outlier_size=0)

    def bound(self, depth: float) -> float:
        """Return the largest error [m] of a reading at a depth [m] that is not an outlier."""
        noise = WIDEST * (self.noise_floor + self.noise_growth * (depth - self.noise_from) ** 2)
        if self.rounding == "step":
            return noise + self.step / 2
        return (depth + noise) / (1.0 - (depth + noise) * self.step / 2) - depth

    @property
    def random(self) -> bool:
        """Whether readings have random errors."""
        return any((self.noise_floor, self.noise_growth, self.missing, self.missing_at_edges,
                    self.outliers))

    def packed(self) -> Array:
        """Return the array (9,) for `expose`."""
        return np.array([self.noise_floor, self.noise_growth, self.noise_from,
                         self.rounding == "disparity", self.step, self.near, self.far,
                         self.missing, self.missing_at_edges])

    def add_outliers(self, rng: np.random.Generator, reading: NDArray[np.float32]) -> None:
        """Add this frame's outlier, if it has one, to a reading (h, w)."""
        if rng.random() >= self.outliers:
            return
        v, u = rng.integers(reading.shape[0]), rng.integers(reading.shape[1])
        half = int(rng.integers(self.outlier_size + 1))
        behind = float(reading[v, u]) or self.far
        reading[max(v - half, 0):v + half + 1, max(u - half, 0):u + half + 1] = (
            rng.uniform(self.near, behind) if np.isfinite(behind) else self.near)


@register("sensors", "camera", shipped=True)
class CameraSection(DepthErrors, ImageSection):
    """A simulated depth camera that sees obstacles and robot; see scenarios.cell.sensors.camera."""

    kind: Literal["camera"]
    width: Pixels = 640
    """Columns of the image."""
    height: Pixels = 480
    """Rows of the image."""
    fx: Annotated[Positive, Unit("px")] = 525.0
    """Focal length, horizontally."""
    fy: Annotated[Positive, Unit("px")] = 525.0
    """Focal length, vertically."""
    cx: Annotated[Finite, Unit("px")] | None = None
    """Column of the optical axis, by default the middle."""
    cy: Annotated[Finite, Unit("px")] | None = None
    """Row of the optical axis, by default the middle."""
    position: Point = (0.0, 2.0, 0.7)
    """Where the camera is."""
    look_at: Point = (0.0, 0.3, 0.1)
    """Point that it looks at."""
    rotation: Rows3 | None = None
    """In place of `look_at`: rows of a matrix whose columns are the camera's axes right, down and
    forward in the world."""
    rate: Annotated[Positive, Unit("Hz")] = 30.0
    """Frames per second."""
    jitter: Time = 0.0
    """Largest random shift of a frame; below 1 / rate."""
    seed: Count = 0
    """Seed of errors and jitter."""
    ideal: Flag = False
    """Whether readings have no errors."""
    far: Length = 5.0
    """Depth above which readings are missing."""
    point_radius: Distance = 0.02
    """Radius of the balls that stand for obstacles that are points."""
    backdrop: Distance = 4.0
    """Depth of a wall behind everything, 0 for none, which may leave too few readings."""


@register("sensors", "frames", shipped=True)
class FramesSection(ImageSection):
    """Depth images that were recorded, with their camera and times.

    See scenarios.cell.sensors.frames.
    """

    is_recorded: ClassVar[bool] = True
    kind: Literal["frames"]
    folder: str
    """Folder of the images, relative to the scenario's file, or the name of a shipped set."""


class OwnSensor(AnySensor, OwnSection):
    """A sensor of a plug-in, with its keys."""

    group: ClassVar[Group] = "sensors"
    foot: ClassVar[float] = FOOT


SensorKind = Annotated[AnySensor, Registered("exact", "sensors", OwnSensor)]
