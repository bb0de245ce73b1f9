"""Common parts of sections: numbers and paths."""

from __future__ import annotations

from collections.abc import Callable, Collection
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from hierarchy import plugins
from hierarchy.plugins import Group

# Strict: true is not 1.0, and "5" is not 5. A whole number may be given for a float.
Finite = Annotated[float, Field(strict=True, allow_inf_nan=False)]
Positive = Annotated[float, Field(strict=True, gt=0.0, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(strict=True, ge=0.0, allow_inf_nan=False)]
Share = Annotated[float, Field(strict=True, ge=0.0, le=1.0)]
Count = Annotated[int, Field(strict=True, ge=0)]
Whole = Annotated[int, Field(strict=True)]
Flag = Annotated[bool, Field(strict=True)]
JointValue = Finite | tuple[Finite, ...]  # see hierarchy.Robot.configuration
Vector3 = tuple[Finite, Finite, Finite]
Rows3 = tuple[Vector3, Vector3, Vector3]


class Section(BaseModel):
    """A table of a scenario file: unknown keys are rejected, and it is immutable.

    `tag` is the key that says its kind, where there are several.
    """

    tag: ClassVar[str] = "kind"
    model_config = ConfigDict(frozen=True, extra="forbid", strict=False,
                              serialize_by_alias=True)


PLUGIN = "plugin"  # the tag of sections whose kind a plugin has registered


def kind_or(default: str | None, group: Group | None = None, known: Collection[str] = ()
            ) -> Callable[[Any], str | None]:
    """Return a function that reads the kind of a table or section, `default` if it has none.

    With a `group` the kind is PLUGIN for one that is not `known`, but registered there.
    """
    def kind(section: Any) -> str | None:
        found = (section.get("kind", default) if isinstance(section, dict)
                 else getattr(section, "kind", default))
        if not isinstance(found, str):
            return None if found is None else str(found)
        own = group and found not in known and plugins.find(group, found) is not None
        return PLUGIN if own else found

    return kind


class JitterSection(Section):
    """A smooth random motion of a path: at most `amplitude` [m] in each axis, up to `rate` [Hz].

    The same `seed` gives the same motion.
    """

    amplitude: NotNegative
    rate: Positive
    seed: Count = 0


class _AnyPath(Section):
    """What every path may have.

    `out_of_reach`: spans of time [s] in which the robot cannot be on the path. The loop ignores
    them; metrics say how the robot comes back.
    """

    jitter: JitterSection | None = None
    out_of_reach: tuple[tuple[NotNegative, NotNegative], ...] | None = None

    @model_validator(mode="after")
    def _spans_are_in_order(self) -> Self:
        times = [t for span in self.out_of_reach or () for t in span]
        if any(b <= a for a, b in pairwise(times)):
            raise ValueError(f"out_of_reach: times must increase, got {times}")
        return self


class StillSection(_AnyPath):
    """A point that does not move, `position` [m]."""

    kind: Literal["still"]
    position: Vector3


class EllipseSection(_AnyPath):
    """p(t) = centre + cosine cos(s) + sine sin(s) [m] with s = rate t + phase [rad]."""

    kind: Literal["ellipse"]
    centre: Vector3
    cosine: Vector3
    sine: Vector3
    rate: Finite = 1.0
    phase: Finite = 0.0


class WaypointsSection(_AnyPath):
    """Points [m] at increasing times [s], at rest at each point.

    With `blend` [s] it does not stop: it rounds each point in a curve of that duration and is
    nearest to it half that time later, see hierarchy.paths.Blended.
    """

    kind: Literal["waypoints"]
    times: tuple[NotNegative, ...]
    points: tuple[Vector3, ...]
    blend: Positive | None = None


class LineSection(_AnyPath):
    """Straight from `start` to `end` [m] within `duration` [s], from `begin` [s] on."""

    kind: Literal["line"]
    start: Vector3
    end: Vector3
    duration: Positive
    begin: NotNegative = 0.0


class CircleSection(_AnyPath):
    """A circle of `radius` [m] about `normal`; rate [rad/s], phase [rad]."""

    kind: Literal["circle"]
    centre: Vector3
    radius: NotNegative
    normal: Vector3 = (0.0, 0.0, 1.0)
    rate: Finite = 1.0
    phase: Finite = 0.0


class RecordedSection(_AnyPath):
    """A recorded motion: a CSV `file` with t [s], x, y, z [m], relative to the scenario's file."""

    kind: Literal["recorded"]
    file: str


PathSection = Annotated[StillSection | LineSection | CircleSection | EllipseSection
                        | WaypointsSection | RecordedSection, Field(discriminator="kind")]
