"""The keys of [[contacts]] and [forces]: what touches, and which forces it may transmit."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

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
    """Points of `frame` that push on a rigid surface, see hierarchy.contacts.Contact.

    `x` and `y` [m] are the sides of a sole from `offset` [m] on, without them it is that point. The
    sole is across `up`, a direction in the frame: x is the frame's x axis as seen along `up`, or
    its y axis if `up` is along x. `friction` is what the controller believes, `normal` the
    direction in the world in which the surface pushes. In each interval of `open` [s] the contact
    is lifted; for `ramp` [s] before, its load falls from what it carries, and after it, rises as
    far as the robot's weight. A point that `slides` moves along its surface. The name defaults to
    the frame's.
    """

    frame: str
    name: TaskName | None = None
    x: tuple[Place, Place] | None = None
    y: tuple[Place, Place] | None = None
    offset: Point = (0.0, 0.0, 0.0)
    friction: Positive = 0.7
    normal: Vector3 = (0.0, 0.0, 1.0)
    up: Vector3 = (0.0, 0.0, 1.0)
    open: tuple[tuple[Time, Time], ...] = ()
    ramp: Time = 0.1
    slides: Flag = False

    @model_validator(mode="after")
    def _is_a_sole_or_a_point(self) -> Self:
        if (self.x is None) != (self.y is None):
            raise ValueError("a sole has x and y, a point neither")
        if self.x is not None and self.slides:
            raise ValueError("only a point slides")
        return self


class ForcesSection(Section):
    """The contact forces that the stack allows, as one level with the torque limits.

    Of each point: a friction pyramid with `faces`, and a normal force from `least` to `largest`
    [N], None for no upper bound. The centre of pressure of a sole stays `edge` [m] inside it,
    None for just inside. What velocity a contact has is damped by `damping` [1/s]. Like the rows
    of [limits], these are in the stack if `limits.place` says so.
    """

    faces: Literal[4, 8] = 4
    least: Force = 0.0
    largest: Annotated[Positive, Unit("N")] | None = None
    edge: Annotated[float, Field(strict=True, gt=0.0), Unit("m")] | None = None
    damping: Gain = 20.0
