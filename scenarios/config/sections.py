"""Common parts of sections: numbers, paths, and the tasks of `[[tasks]]`."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
Vector3 = tuple[Finite, Finite, Finite]
Rows3 = tuple[Vector3, Vector3, Vector3]


class Section(BaseModel):
    """A table of a scenario file: unknown keys are rejected, and it is immutable."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False)


class StillSection(Section):
    """A point that does not move, `position` [m]."""

    kind: Literal["still"]
    position: Vector3


class EllipseSection(Section):
    """p(t) = centre + cosine cos(rate t) + sine sin(rate t), [m] and [rad/s]."""

    kind: Literal["ellipse"]
    centre: Vector3
    cosine: Vector3
    sine: Vector3
    rate: Finite = 1.0


class WaypointsSection(Section):
    """Points [m] at increasing times [s], at rest at each point."""

    kind: Literal["waypoints"]
    times: tuple[NotNegative, ...]
    points: tuple[Vector3, ...]


PathSection = Annotated[StillSection | EllipseSection | WaypointsSection,
                        Field(discriminator="kind")]
TaskName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_ -]*$")]


class _Listed(Section):
    """A task of `[[tasks]]`; its name defaults to its kind."""

    name: TaskName | None = None
    stiffness: NotNegative = 40.0
    damping: NotNegative = 20.0
    gain: NotNegative = 10.0

    @property
    def title(self) -> str:
        """The task's name in stacks, messages and tables."""
        return self.name or str(getattr(self, "kind", ""))


class _Along(_Listed):
    """Follow `path`, or stay at the initial position without one.

    With `from_start` the path is relative to the initial position.
    """

    path: PathSection | None = None
    from_start: bool = False

    @model_validator(mode="after")
    def _has_a_path_to_shift(self) -> Self:
        if self.from_start and self.path is None:
            raise ValueError("from_start needs a path")
        return self


class ListedPosition(_Along):
    """The origin of `frame` along a path (3 rows)."""

    kind: Literal["position"]
    frame: str


class ListedPose(_Along):
    """Origin and axes of `frame` (6 rows); `rotation` (rows) defaults to the initial one."""

    kind: Literal["pose"]
    frame: str
    rotation: Rows3 | None = None


class ListedCentreOfMass(_Along):
    """The centre of mass along some of the axes "x", "y", "z" of the world."""

    kind: Literal["com"]
    axes: Literal["x", "y", "z", "xy", "xz", "yz", "xyz"] = "xyz"


class ListedPointing(_Listed):
    """The z axis of `frame` at `alpha_d` [deg] from `axis`, or with "inequality" at most that."""

    kind: Literal["pointing"]
    frame: str
    axis: Vector3
    alpha_d: Annotated[float, Field(ge=0.0, le=180.0)]
    rows: Literal["equality", "inequality"] = "inequality"
    stiffness: NotNegative = 5.0
    damping: NotNegative = 2.0
    gain: NotNegative = 5.0


class ListedPosture(_Listed):
    """All joints to `target` [rad or m], by default the start; `joints` override it by name."""

    kind: Literal["posture"]
    target: tuple[Finite, ...] | None = None
    joints: dict[str, Finite] = Field(default_factory=dict)
    stiffness: NotNegative = 10.0
    damping: NotNegative = 5.0
    gain: NotNegative = 1.0


ListedTask = Annotated[
    ListedPosition | ListedPose | ListedCentreOfMass | ListedPointing | ListedPosture,
    Field(discriminator="kind")]
