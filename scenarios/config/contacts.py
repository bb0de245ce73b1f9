"""The keys of [[contacts]] and [forces]: what touches, and which forces it may transmit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from scenarios.config.sections import (
    Finite,
    Flag,
    Force,
    Gain,
    Point,
    Positive,
    Section,
    TaskName,
    Time,
    Unit,
    Vector3,
)

Place = Annotated[Finite, Unit("m")]


class ContactSection(Section):
    """Points of a frame that push on a rigid surface, see hierarchy.contacts.Contact."""

    frame: str
    """Frame of the robot."""
    name: TaskName | None = None
    """Its name in messages, tables and figures; by default the frame's."""
    x: tuple[Place, Place] | None = None
    """Sides of a sole along its x axis, from `offset` on; without `x` and `y` the contact is that
    point."""
    y: tuple[Place, Place] | None = None
    """The same along its y axis."""
    offset: Point = (0.0, 0.0, 0.0)
    """The point, or the middle of the sole, in the frame."""
    friction: Positive = 0.7
    """Coefficient of friction that the controller believes."""
    normal: Vector3 = (0.0, 0.0, 1.0)
    """Direction in the world in which the surface pushes."""
    up: Vector3 = (0.0, 0.0, 1.0)
    """Direction in the frame across the sole: x is the frame's x axis as seen along it, or the
    frame's y axis if it is along x."""
    open: tuple[tuple[Time, Time], ...] = ()
    """Intervals in which the contact is lifted."""
    ramp: Time = 0.1
    """Time in which the load falls before such an interval, and rises after it to at most the
    robot's weight."""
    slides: Flag = False
    """Whether a point may move along its surface."""

    def _wrong(self) -> Iterator[str]:
        if (self.x is None) != (self.y is None):
            yield "a sole has x and y, a point neither"
        if self.x is not None and self.slides:
            yield "only a point slides"


class ForcesSection(Section):
    """The contact forces that the stack allows, as one level with the torque limits.

    Like the rows of [limits], these are in the stack if `limits.place` says so.
    """

    faces: Literal[4, 8] = 4
    """Faces of the friction pyramid of each point."""
    least: Force = 0.0
    """Smallest normal force of each point."""
    largest: Annotated[Positive, Unit("N")] | None = None
    """Largest normal force of each point; without it there is no upper bound."""
    edge: Annotated[float, Field(strict=True, gt=0.0), Unit("m")] | None = None
    """How far inside a sole its centre of pressure stays; without it just inside."""
    damping: Gain = 20.0
    """Gain that damps the velocity of contacts."""
