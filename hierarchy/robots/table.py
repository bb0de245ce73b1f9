"""Robots as tables of numbers: a serial arm by its Denavit-Hartenberg parameters, or any tree."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal, cast

from hierarchy.errors import brief, expect, expect_each, finite_numbers, number, real, refuse
from hierarchy.gate import array_of, direction
from hierarchy.records import Check, NotNegative, check_fields


def _limits(what: str, values: object) -> None:
    found = array_of(what, values)
    refuse(found.ndim != 1, f"{what}: expected a list of numbers, got {brief(values)}")
    for i, value in enumerate(found):
        real(f"{what}[{i}]", value, 0.0)


def _pairs(what: str, values: object, of_joint: Check, remedy: str) -> None:
    expect(what, values, Sequence, remedy)
    for i, pair in enumerate(cast("Sequence[object]", values)):
        refuse(not isinstance(pair, tuple | list) or len(pair) != 2 or type(pair[0]) is not str,
               f"{what}[{i}]: expected a pair, got {brief(pair)}; {remedy}")
        of_joint(f"{what}[{i}]", cast("Sequence[object]", pair)[1])


Base = Literal["fixed", "floating"]
Vector = Annotated[tuple[float, float, float], partial(finite_numbers, size=3)]
Numbers = Annotated[tuple[float, ...], finite_numbers]
Limits = Annotated[tuple[float, ...], _limits]
ControlPoints = Annotated[tuple[tuple[str, Vector], ...], partial(
    _pairs, of_joint=partial(finite_numbers, size=3), remedy="give (joint, offset)")]


@dataclass(frozen=True)
class DHTable:
    """Standard Denavit-Hartenberg parameters: T_i = Rz(q_i) Tz(d_i) Tx(a_i) Rx(alpha_i).

    One entry per joint: a, d [m], alpha [deg]; position limits +-`range` [deg]; `velocity` [rad/s];
    `effort` limits [N m]; `mass` [kg] of the link that the joint moves. Each link is a
    uniform rod of radius `radius` [m] between its joint and the next. `control_points` are (joint,
    offset (3,) [m] in the joint's frame). Raises HierarchyError for entries that do not fit.
    """

    name: str
    a: Numbers
    d: Numbers
    alpha: Numbers
    range: Limits
    velocity: Limits
    effort: Limits
    mass: Numbers
    radius: NotNegative
    control_points: ControlPoints

    def __post_init__(self) -> None:
        check_fields(self, f"table {self.name!r}")
        for name in ("a", "alpha", "range", "velocity", "effort", "mass"):
            refuse(len(getattr(self, name)) != len(self.d), f"table {self.name!r}: {name} has "
                   f"{len(getattr(self, name))} entries, and d {len(self.d)}, one for each joint")


@dataclass(frozen=True)
class Link:
    """The body that a joint moves: a uniform capsule of `mass` [kg] and `radius` [m].

    It goes from `start` to `end` (3,) [m] in the joint's frame. A link of radius 0 has no shape;
    its joint shares an origin with the next one.
    """

    end: Vector = (0.0, 0.0, 0.0)
    radius: NotNegative = 0.0
    mass: NotNegative = 0.0
    start: Vector = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        check_fields(self, "link")


@dataclass(frozen=True)
class TreeJoint:
    """One revolute joint of a tree.

    `parent` is a joint further up in the table, "" the base; `at` (3,) [m] is the joint's origin in
    the parent's frame, whose axes it has at angle zero; `axis` is "x", "y" or "z" of that frame.
    `range` (lower, upper) [deg], `velocity` [rad/s], `effort` [N m]; `rest` [deg] is the angle of
    the default initial configuration.
    """

    name: str
    parent: str
    at: Vector
    axis: Literal["x", "y", "z"]
    range: Annotated[tuple[float, float], partial(finite_numbers, size=2)]
    velocity: Annotated[float, partial(real, least=0.0)]
    effort: Annotated[float, partial(real, least=0.0)]
    link: Annotated[Link, partial(expect, kind=Link, remedy="give a Link")] = Link()
    rest: Annotated[float, number] = 0.0

    def __post_init__(self) -> None:
        check_fields(self, f"joint {self.name!r}")
        refuse(self.range[0] > self.range[1], f"joint {self.name!r}: range: expected (lower, "
               f"upper), got {brief(self.range)}")


@dataclass(frozen=True)
class TreeFrame:
    """A frame fixed to what `joint` moves ("" the base), `offset` (3,) [m] in the joint's frame.

    Its axes are those of the joint, or turned so that z is `z_axis`.
    """

    name: str
    joint: str
    offset: Vector
    z_axis: Annotated[tuple[float, float, float], direction] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        check_fields(self, f"frame {self.name!r}")


@dataclass(frozen=True)
class TreeTable:
    """A robot with a tree of revolute joints: right after each come all that hang on it.

    `base` "floating" gives it six more velocities, those of the base's own frame, which is at
    `base_height` [m] above the world's origin at the start. `links` are further shapes as (joint,
    link), "" being the base, and `control_points` as (joint, offset (3,) [m]).
    """

    name: str
    joints: tuple[TreeJoint, ...]
    frames: tuple[TreeFrame, ...]
    end_effector: str
    links: Annotated[tuple[tuple[str, Link], ...], partial(
        _pairs, of_joint=partial(expect, kind=Link, remedy="give a Link"),
        remedy="give (joint, link)")] = ()
    control_points: ControlPoints = ()
    base: Base = "fixed"
    base_height: Annotated[float, number] = 0.0

    def __post_init__(self) -> None:
        what = f"table {self.name!r}"
        check_fields(self, what)
        expect_each(f"{what}: joints", self.joints, TreeJoint, "give TreeJoint(...)")
        expect_each(f"{what}: frames", self.frames, TreeFrame, "give TreeFrame(...)")


Table = DHTable | TreeTable


def in_words(table: Table) -> str:
    """Describe a table in a list of robots."""
    if isinstance(table, DHTable):
        return f"an arm of {len(table.d)} joints"
    floating = ", on a floating base" if table.base == "floating" else ""
    return f"a tree of {len(table.joints)} joints{floating}"
