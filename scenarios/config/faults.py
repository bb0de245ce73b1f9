"""The keys of [[faults]]: trouble that is injected."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from scenarios.config.robot import ControlPointSection
from scenarios.config.sections import NotNegative, Positive, Section, Vector3


class FaultSection(Section):
    """Something that goes wrong on purpose from `at` [s] on, for `duration` [s].

    nan_position, nan_velocity: what is measured of `joint` (1, 2, ...; of all without it) is NaN.
    nan_distance: so is the distance of `point` (control points 1, 2, ..., then the end effector;
    of all without it). stale: joints and distances stay as they were. status: the resolver says
    `status` of its answer. overrun: the tick takes `takes` [s] more. obstacle: a sphere of `radius`
    [m] stands at `centre` [m], or at `place` on the body as this was when the sphere appeared.
    no_frames: the camera takes no images; dark_frames: they have no readings.
    """

    kind: Literal["nan_position", "nan_velocity", "nan_distance", "stale", "status", "overrun",
                  "obstacle", "no_frames", "dark_frames"]
    at: NotNegative
    duration: Positive
    joint: Annotated[int, Field(ge=1)] | None = None
    point: Annotated[int, Field(ge=1)] | None = None
    status: Literal["iteration_limit", "numerical_failure", "backend_failure",
                    "inaccurate"] | None = None
    takes: Positive | None = None
    centre: Vector3 | None = None
    place: ControlPointSection | None = None
    radius: Positive | None = None

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
