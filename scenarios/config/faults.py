"""The keys of [[faults]]: injected faults."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.config.robot import ControlPointSection
from scenarios.config.sections import Length, Point, Section, Span, Time


class FaultSection(Section):
    """A fault injected at `at` [s] for `duration` [s].

    nan_position, nan_velocity: the measurement of `joint` (1, 2, ...; default all) is NaN.
    nan_distance: the distance of `point` (control points 1, 2, ..., then the end effector; default
    all) is NaN. stale: measured joints and distances are frozen. status: the resolver reports
    `status`. overrun: the tick takes `takes` [s] longer. obstacle: a sphere of `radius` [m] appears
    at `centre` [m], or where `place` on the body is at that time. no_frames: the camera takes no
    images. dark_frames: its images have no readings.
    """

    kind: Literal["nan_position", "nan_velocity", "nan_distance", "stale", "status", "overrun",
                  "obstacle", "no_frames", "dark_frames"]
    at: Time
    duration: Span
    joint: Annotated[int, Field(strict=True, ge=1)] | None = None
    point: Annotated[int, Field(strict=True, ge=1)] | None = None
    status: Literal["iteration_limit", "numerical_failure", "backend_failure",
                    "inaccurate"] | None = None
    takes: Span | None = None
    centre: Point | None = None
    place: ControlPointSection | None = None
    radius: Length | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        of_kind = {"nan_position": {"joint"}, "nan_velocity": {"joint"}, "nan_distance": {"point"},
                   "status": {"status"}, "overrun": {"takes"},
                   "obstacle": {"centre", "place", "radius"}}.get(self.kind, set())
        for key in ("joint", "point", "status", "takes", "centre", "place", "radius"):
            if getattr(self, key) is not None and key not in of_kind:
                raise ValueError(f"a fault of kind {self.kind!r} takes no {key}")
        for key in of_kind & {"status", "takes", "radius"}:
            if getattr(self, key) is None:
                raise ValueError(f"a fault of kind {self.kind!r} needs {key}")
        if self.kind == "obstacle" and (self.centre is None) == (self.place is None):
            raise ValueError("give either a centre or a place")
        return self
