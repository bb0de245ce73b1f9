"""The keys of [[faults]]: injected faults."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from scenarios.config.robot import ControlPointSection
from scenarios.config.sections import Length, Point, Section, Span, Time


class FaultSection(Section):
    """An injected fault."""

    kind: Literal["nan_position", "nan_velocity", "nan_distance", "stale", "status", "overrun",
                  "obstacle", "no_frames", "dark_frames"]
    """"nan_position", "nan_velocity": the measurement of `joint` is NaN. "nan_distance": the
    distance of `point` is NaN. "stale": measured joints and distances are frozen. "status": the
    resolver reports `status`. "overrun": the tick takes longer. "obstacle": a sphere appears.
    "no_frames": the camera takes no images. "dark_frames": its images have no readings."""
    at: Time
    """When it begins."""
    duration: Span
    """How long it lasts."""
    joint: Annotated[int, Field(strict=True, ge=1)] | None = None
    """Number of a joint from 1; by default all."""
    point: Annotated[int, Field(strict=True, ge=1)] | None = None
    """Number of a control point from 1, then of the end effector; by default all."""
    status: Literal["iteration_limit", "numerical_failure", "backend_failure",
                    "inaccurate"] | None = None
    """What the resolver reports."""
    takes: Span | None = None
    """Time that a tick takes longer."""
    centre: Point | None = None
    """Middle of the sphere."""
    place: ControlPointSection | None = None
    """Point of the body, in place of `centre`, where the sphere appears at that time."""
    radius: Length | None = None
    """Radius of the sphere."""

    def _wrong(self) -> Iterator[str]:
        of_kind = {"nan_position": {"joint"}, "nan_velocity": {"joint"}, "nan_distance": {"point"},
                   "status": {"status"}, "overrun": {"takes"},
                   "obstacle": {"centre", "place", "radius"}}.get(self.kind, set())
        for key in ("joint", "point", "status", "takes", "centre", "place", "radius"):
            if getattr(self, key) is not None and key not in of_kind:
                yield f"a fault of kind {self.kind!r} takes no {key}"
        for key in of_kind & {"status", "takes", "radius"}:
            if getattr(self, key) is None:
                yield f"a fault of kind {self.kind!r} needs {key}"
        if self.kind == "obstacle" and (self.centre is None) == (self.place is None):
            yield "give either a centre or a place"
