"""Robots as tables of numbers: a serial arm by its Denavit-Hartenberg parameters, or any tree."""

from dataclasses import dataclass
from typing import Annotated, Literal

from hierarchy.errors import finite_numbers, refuse
from hierarchy.records import NotNegative, check_fields

Vector = tuple[float, float, float]
Base = Literal["fixed", "floating"]
Numbers = Annotated[tuple[float, ...], finite_numbers]


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
    range: Numbers
    velocity: Numbers
    effort: Numbers
    mass: Numbers
    radius: NotNegative
    control_points: tuple[tuple[str, Vector], ...]

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
    radius: float = 0.0
    mass: float = 0.0
    start: Vector = (0.0, 0.0, 0.0)


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
    range: tuple[float, float]
    velocity: float
    effort: float
    link: Link = Link()
    rest: float = 0.0


@dataclass(frozen=True)
class TreeFrame:
    """A frame fixed to what `joint` moves ("" the base), `offset` (3,) [m] in the joint's frame.

    Its axes are those of the joint, or turned so that z is `z_axis`.
    """

    name: str
    joint: str
    offset: Vector
    z_axis: Vector = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class TreeTable:
    """A robot with a tree of revolute joints; parents come before their children.

    `base` "floating" gives it six more velocities, those of the base's own frame, which is at
    `base_height` [m] above the world's origin at the start. `links` are further shapes as (joint,
    link), "" being the base, and `control_points` as (joint, offset (3,) [m]).
    """

    name: str
    joints: tuple[TreeJoint, ...]
    frames: tuple[TreeFrame, ...]
    end_effector: str
    links: tuple[tuple[str, Link], ...] = ()
    control_points: tuple[tuple[str, Vector], ...] = ()
    base: Base = "fixed"
    base_height: float = 0.0


Table = DHTable | TreeTable


def in_words(table: Table) -> str:
    """Describe a table in a list of robots."""
    if isinstance(table, DHTable):
        return f"an arm of {len(table.d)} joints"
    floating = ", on a floating base" if table.base == "floating" else ""
    return f"a tree of {len(table.joints)} joints{floating}"
