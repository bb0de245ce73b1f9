"""What pushes on a robot, and what holds it up, as segments: forces, cones, support polygon."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from hierarchy.problem import Array
from scenarios.config import Scenario
from scenarios.config.sections.plant import PushSection
from scenarios.recording.facts import ContactPoint, Facts, RobotFacts, placed_points

_LENGTH = 0.002   # [m] of an arrow per newton
_CONE = 0.05      # [m] height of a friction cone
_EDGES = 8        # of a cone as it is drawn
_LOADED = 1.0     # [N] of normal force from which a point or a contact counts as loaded
_CROSS = 0.02     # [m] half of the cross under the centre of mass
_TABLE = 0.25     # [m] half of the part of a table that is drawn
_HEAD = 0.06      # [m] length of the head of an arrow

_WORDS = {"force": "contact force, 2 mm per newton", "cone": "friction cone",
          "support": "support polygon", "centre": "below the centre of mass",
          "push": "push from outside, 2 mm per newton", "table": "table"}


class Pushes(NamedTuple):
    """Segments (F, S, 2, 3) [m] of F frames; NaN where there is none.

    force : from each contact point along its planned force, 2 mm for each newton.
    cone : the friction cone that the controller believes, of each loaded point.
    support : the support polygon, the convex hull of the points of all loaded contacts from above.
    centre : a cross on the floor below the centre of mass; none with a fixed base.
    push : an arrow to the middle of each body that is pushed from outside, 2 mm for each newton.
    table : a grid of what a robot with a fixed base touches, around its first point; else none.
    """

    force: Array
    cone: Array
    support: Array
    centre: Array
    push: Array
    table: Array


def key(facts: Facts, scenario: Scenario) -> dict[str, str]:
    """Return in words what a run draws of contacts, by the fields of Pushes."""
    if not facts.contacts:
        return {}
    drawn = {"force": True, "cone": True, "support": len(facts.contacts) > 2,
             "centre": facts.robot.base == "floating",
             "push": bool(getattr(scenario.plant, "pushes", ())),
             "table": facts.robot.base == "fixed"}
    return {name: _WORDS[name] for name, it_is in drawn.items() if it_is}


def pushes(facts: Facts, scenario: Scenario, t: Array, placements: Array, forces: Array,
           com: Array | None = None) -> Pushes:
    """Return what is drawn of contacts at times t (F,) [s], with joints at `placements`.

    `forces` (F, P, 3) [N] are those on the contact points of `facts`, `com` (F, 3) [m] is the
    centre of mass.
    """
    none = np.empty((len(placements), 0, 2, 3))
    shoves = [_shove(facts.robot, push, t, placements)
              for push in getattr(scenario.plant, "pushes", ())]  # none of a plugin's plant
    height = getattr(scenario.plant, "height", None)
    fixed = facts.robot.base == "fixed"
    return Pushes(*_contacts(facts.contacts, placements, forces),
                  none if com is None or fixed else _below(com, facts.robot.floor),
                  np.concatenate([none, *shoves], axis=1),
                  _table(facts.contacts[0], height, placements) if fixed and height is not None
                  else none)


def _contacts(points: Sequence[ContactPoint], placements: Array,
              forces: Array) -> tuple[Array, Array, Array]:
    """Return forces, cones and the support polygon."""
    at = placed_points(placements, [point.joint for point in points],
                       [point.offset for point in points])
    normals = np.array([point.normal for point in points])
    carried = (forces * normals).sum(axis=-1)
    same = np.array([[one.contact == other.contact for one in points] for other in points])
    loaded, stands = carried > _LOADED, carried @ same > _LOADED
    force = np.stack([at, at + _LENGTH * forces], axis=-2)
    force[~np.isfinite(forces).all(axis=-1)] = np.nan
    cone = at[:, :, None, None] + np.array([_cone(point) for point in points])
    cone[~loaded] = np.nan
    support = np.array([_hull(p[on], len(points)) for p, on in zip(at, stands, strict=True)])
    return force, cone.reshape(len(at), -1, 2, 3), support


def _below(com: Array, floor: float) -> Array:
    """Return a cross (F, 2, 2, 3) on the floor below the centre of mass."""
    arms = _CROSS * np.array([[[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
                              [[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]]])
    place = np.column_stack([com[:, :2], np.full(len(com), floor)])
    return np.asarray(place[:, None, None] + arms)


def _table(point: ContactPoint, height: float, placements: Array) -> Array:
    """Return a grid (F, S, 2, 3) at the height of the plant's floor, below the first frame's hand.

    Its lines are where those of other frames would be: a live run shows one frame at a time.
    """
    hand = placed_points(placements[0], [point.joint], point.offset)[0]
    x, y, _ = np.round(hand / _TABLE * 4) * _TABLE / 4
    at = np.linspace(-_TABLE, _TABLE, 9)
    along = np.array([[[-_TABLE, one, 0.0], [_TABLE, one, 0.0]] for one in at])
    lines = np.concatenate([along, along[..., [1, 0, 2]]])
    return np.tile(lines + np.array([x, y, height]), (len(placements), 1, 1, 1))


def _shove(robot: RobotFacts, push: PushSection, t: Array, placements: Array) -> Array:
    """Return the arrow (F, 5, 2, 3) of a push to its body, NaN when it does not push."""
    joint = robot.joint_names.index(push.joint) + 1
    body = [(np.array(one.start) + one.end) / 2 for one in robot.capsules if one.joint == joint]
    middle = np.mean(body, axis=0) if body else np.zeros(3)
    tip = placed_points(placements, [joint], middle)
    way = _LENGTH * push.vector
    length = float(np.linalg.norm(way))
    along = way / (length or 1.0)
    across = 0.4 * np.linalg.svd(along[None])[2][1:]
    barbs = min(_HEAD, length) * (np.concatenate([across, -across]) - along)
    shaft_and_head = np.stack([np.array([-way, *barbs]), np.zeros((5, 3))], axis=1)
    arrow: Array = tip[:, :, None] + shaft_and_head
    arrow[~push.acts(t)] = np.nan
    return arrow


def _cone(point: ContactPoint) -> Array:
    """Return the edges and the rim of a friction cone at the origin (2 _EDGES, 2, 3)."""
    n = np.array(point.normal)
    across = np.linalg.svd(n[None])[2][1:]
    angles = np.linspace(0.0, 2.0 * np.pi, _EDGES + 1)
    circle = np.column_stack([np.cos(angles), np.sin(angles)]) @ across
    rim = _CONE * (n + point.friction * circle)
    edges = np.stack([np.zeros((_EDGES, 3)), rim[:-1]], axis=1)
    return np.concatenate([edges, np.stack([rim[:-1], rim[1:]], axis=1)])


def _hull(points: Array, count: int) -> Array:
    """Return the edges (count, 2, 3) of the hull of points (k, 3) from above, NaN beyond them."""
    from scipy.spatial import ConvexHull, QhullError

    edges = np.full((count, 2, 3), np.nan)
    try:
        corners = ConvexHull(points[:, :2]).vertices
    except (QhullError, ValueError):  # on a line, of which the ends count; or there are none
        corners = np.lexsort((points[:, 1], points[:, 0]))[[0, -1] if len(points) > 1 else []]
    ring = points[corners]
    edges[:len(ring)] = np.stack([ring, np.roll(ring, -1, axis=0)], axis=1)
    return edges
