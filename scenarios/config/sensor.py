"""The keys of [sensor]."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from pydantic import Field

from hierarchy.plugins import Group, register
from scenarios.config.own import OwnSection
from scenarios.config.sections import (
    Count,
    Finite,
    Flag,
    NotNegative,
    Positive,
    Section,
    Share,
    Vector3,
    any_kind,
)

Pixels = Annotated[int, Field(strict=True, ge=1, le=8192)]
_FOOT = 0.31  # [m] height of the column that a robot without floor stands on


class AnySensor(Section):
    """What every sensor has: the height `foot` [m] of the column that its robot stands on."""

    kind: str
    if TYPE_CHECKING:
        foot: ClassVar[float]


@register("sensors", "exact", shipped=True)
class ExactSection(AnySensor):
    """Distances of the known geometry, without errors."""

    foot: ClassVar[float] = _FOOT
    kind: Literal["exact"] = "exact"


class _ImageSection(AnySensor):
    """What sources of depth images have; see scenarios.cell.sensors.depth_space.

    A frame is available `latency` [s] after it was taken. Without a new frame for more than
    `stale_after` [s] the camera is blind and `control.policy.stale` applies; frames with fewer
    valid pixels than the share `least_readings` do not count. The robot's capsules, with a column
    of height `foot` [m] below the base, are removed from the image with a `margin` [m]. Obstacles
    are seen within `region` [m] of a point, by default the largest distance at which avoidance
    acts. Obstacles extend `thin` [m] behind their surface, by default without bound. A pixel counts
    if `support` of the nine around it agree within `band` [m].
    """

    latency: NotNegative = 0.0
    stale_after: NotNegative = 0.2
    least_readings: Share = 0.1
    foot: NotNegative = _FOOT  # type: ignore[misc]
    margin: NotNegative = 0.05
    region: Positive | None = None
    thin: NotNegative | None = None
    support: Annotated[int, Field(strict=True, ge=1, le=9)] = 3
    band: NotNegative = 0.05


@register("sensors", "camera", shipped=True)
class CameraSection(_ImageSection):
    """A simulated depth camera that sees obstacles and robot; see scenarios.cell.sensors.camera.

    Image size, focal lengths and centre [px], by default the middle; position [m]; a point [m] to
    look at, or a rotation, which takes precedence: rows, whose columns are the camera's axes right,
    down and forward in the world. `rate` [Hz] and `jitter` [s] of the frames; random `seed`;
    `ideal` for no errors (else those of scenarios.cell.sensors.errors); `backdrop` [m], the depth
    of a wall, 0 for none, which may leave too few readings; `point_radius` [m] of the balls that
    represent points.
    """

    kind: Literal["camera"]
    width: Pixels = 640
    height: Pixels = 480
    fx: Positive = 525.0
    fy: Positive = 525.0
    cx: Finite | None = None
    cy: Finite | None = None
    position: Vector3 = (0.0, 2.0, 0.7)
    look_at: Vector3 = (0.0, 0.3, 0.1)
    rotation: tuple[Vector3, Vector3, Vector3] | None = None
    rate: Positive = 30.0
    jitter: NotNegative = 0.0
    seed: Count = 0
    ideal: Flag = False
    noise_floor: NotNegative = 1.2e-3
    noise_growth: NotNegative = 1.9e-3
    noise_from: NotNegative = 0.4
    rounding: Literal["disparity", "step"] = "disparity"
    step: NotNegative = 2.85e-3
    near: NotNegative = 0.5
    far: Positive = 5.0
    missing: Share = 0.002
    missing_at_edges: Share = 0.3
    outliers: Share = 0.02
    outlier_size: Count = 2
    point_radius: NotNegative = 0.02
    backdrop: NotNegative = 4.0


@register("sensors", "frames", shipped=True)
class FramesSection(_ImageSection):
    """Depth images from a `folder` or a shipped set, with their camera and times.

    See scenarios.cell.sensors.frames.
    """

    kind: Literal["frames"]
    folder: str


class OwnSensor(AnySensor, OwnSection):
    """A sensor of a plugin; its keys are those of the plugin."""

    group: ClassVar[Group] = "sensors"
    foot: ClassVar[float] = _FOOT


if TYPE_CHECKING:
    SensorKind = AnySensor
else:
    SensorKind = any_kind("sensors", OwnSensor, "exact")
