"""Common parts of sections: numbers and paths."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Vector3 = tuple[Finite, Finite, Finite]
Rows3 = tuple[Vector3, Vector3, Vector3]


class Section(BaseModel):
    """A table of a scenario file: unknown keys are rejected, and it is immutable."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False,
                              serialize_by_alias=True)


class StillSection(Section):
    """A point that does not move, `position` [m]."""

    kind: Literal["still"]
    position: Vector3


class EllipseSection(Section):
    """p(t) = centre + cosine cos(s) + sine sin(s) [m] with s = rate t + phase [rad]."""

    kind: Literal["ellipse"]
    centre: Vector3
    cosine: Vector3
    sine: Vector3
    rate: Finite = 1.0
    phase: Finite = 0.0


class WaypointsSection(Section):
    """Points [m] at increasing times [s], at rest at each point."""

    kind: Literal["waypoints"]
    times: tuple[NotNegative, ...]
    points: tuple[Vector3, ...]


PathSection = Annotated[StillSection | EllipseSection | WaypointsSection,
                        Field(discriminator="kind")]
