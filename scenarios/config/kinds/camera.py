"""Sensors that see obstacles in depth images: a simulated camera, or recorded frames."""

from __future__ import annotations

from math import inf
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from hierarchy.plugins import register
from hierarchy.problem import Array
from scenarios.config.sections import (
    Count,
    Distance,
    Finite,
    Flag,
    Length,
    NotNegative,
    Point,
    Positive,
    Rows3,
    Section,
    Share,
    Time,
    Unit,
)
from scenarios.config.sensor import FOOT, AnySensor

Pixels = Annotated[int, Field(strict=True, ge=1, le=8192), Unit("px")]
WIDEST = 3.5  # [standard deviations] at which noise is clipped, so that it is bounded


class ImageSection(AnySensor):
    """What sources of depth images have; see scenarios.cell.sensors.depth_space.

    A frame is available `latency` [s] after it was taken. Without a new frame for more than
    `stale_after` [s] the camera is blind and `control.policy.stale` applies; frames with fewer
    valid pixels than the share `least_readings` do not count. The robot's capsules, with a column
    of height `foot` [m] below the base, are removed from the image with a `margin` [m]. Obstacles
    are seen within `region` [m] of a point, by default the largest distance at which avoidance
    acts. Obstacles extend `thin` [m] behind their surface, by default without bound. A pixel counts
    if `support` of the nine around it agree within `band` [m].
    """

    latency: Time = 0.0
    stale_after: Time = 0.2
    least_readings: Share = 0.1
    foot: Distance = FOOT  # type: ignore[misc]
    margin: Distance = 0.05
    region: Length | None = None
    thin: Distance | None = None
    support: Annotated[int, Field(strict=True, ge=1, le=9)] = 3
    band: Distance = 0.05


class DepthErrors(Section):
    """Errors of a depth reading z [m] of a simulated camera; the defaults resemble a Kinect.

    `noise_floor` + `noise_growth` (z - `noise_from`)^2 is the standard deviation [m] of normal
    noise, clipped at 3.5 times that. `rounding` = "step" rounds z to multiples of `step` [m],
    "disparity" 1 / z to multiples of `step` [1/m], as a triangulating camera does; 0 for none.
    Readings outside `near` to `far` [m] are missing, others with the probability `missing`, or
    `missing_at_edges` where a neighbour is 5 cm nearer or farther. With the probability `outliers`
    a frame has a square of up to `outlier_size` pixels to each side of a pixel with a random depth
    before the true one.
    """

    noise_floor: Distance = 1.2e-3
    noise_growth: NotNegative = 1.9e-3
    noise_from: Distance = 0.4
    rounding: Literal["disparity", "step"] = "disparity"
    step: NotNegative = 2.85e-3
    near: Distance = 0.5
    far: Annotated[float, Field(strict=True, gt=0.0), Unit("m")] = 5.0
    missing: Share = 0.002
    missing_at_edges: Share = 0.3
    outliers: Share = 0.02
    outlier_size: Count = 2

    @model_validator(mode="after")
    def _sees_something(self) -> Self:
        if self.near >= self.far:
            raise ValueError(f"near = {self.near} m must be below far = {self.far} m")
        return self

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
    """A simulated depth camera that sees obstacles and robot; see scenarios.cell.sensors.camera.

    Image size, focal lengths and centre [px], by default the middle; position [m]; a point [m] to
    look at, or a rotation, which takes precedence: rows, whose columns are the camera's axes right,
    down and forward in the world. `rate` [Hz] and `jitter` [s] of the frames; random `seed`;
    `ideal` for no errors; `backdrop` [m], the depth
    of a wall, 0 for none, which may leave too few readings; `point_radius` [m] of the balls that
    represent points.
    """

    made_by: ClassVar[str] = "scenarios.cell.sensors.images:camera"
    kind: Literal["camera"]
    width: Pixels = 640
    height: Pixels = 480
    fx: Annotated[Positive, Unit("px")] = 525.0
    fy: Annotated[Positive, Unit("px")] = 525.0
    cx: Annotated[Finite, Unit("px")] | None = None
    cy: Annotated[Finite, Unit("px")] | None = None
    position: Point = (0.0, 2.0, 0.7)
    look_at: Point = (0.0, 0.3, 0.1)
    rotation: Rows3 | None = None
    rate: Annotated[Positive, Unit("Hz")] = 30.0
    jitter: Time = 0.0
    seed: Count = 0
    ideal: Flag = False
    far: Length = 5.0
    point_radius: Distance = 0.02
    backdrop: Distance = 4.0


@register("sensors", "frames", shipped=True)
class FramesSection(ImageSection):
    """Depth images from a `folder` or a shipped set, with their camera and times.

    See scenarios.cell.sensors.frames.
    """

    made_by: ClassVar[str] = "scenarios.cell.sensors.images:frames"
    is_recorded: ClassVar[bool] = True
    kind: Literal["frames"]
    folder: str
