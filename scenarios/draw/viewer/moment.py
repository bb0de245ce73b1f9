"""What is drawn at one moment: a frame of a run that is over or goes on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from scenarios.recording.fate import Fate
from scenarios.scene import Scene
from scenarios.scene.pushes import Pushes


class Became(NamedTuple):
    """Whether a task was met, and the Euclidean norm of its violation in the unit of its rows."""

    fate: Fate
    violation: float
    unit: str = ""


@dataclass(frozen=True)
class Moment:
    """What is drawn at time t [s]; metres, arrays as in `scenarios.scene.Scene`.

    placements (J + 1, 12); points (P, 3), the end effector last; nearest (3,), the obstacle's point
    linked with point `linked`, or None; active, the point that the stack keeps away, or -1;
    centres (H, 3); axis (3,); desired (3,) or None. `order` names the tasks in the stack, most
    important first, `became` has the fate of each; saturated (n,) is the side, -1 or 1, of its
    limits at which each joint is, else 0. `moved` has the point that each listed task moves and its
    desired position or None, `pushes` the segments (S, 2, 3) of contacts, or None.
    """

    t: float
    placements: Array
    points: Array
    nearest: Array | None
    linked: int
    active: int
    centres: Array
    axis: Array
    desired: Array | None
    order: tuple[str, ...]
    became: Mapping[str, Became]
    saturated: NDArray[np.int8]
    moved: tuple[tuple[Array, Array | None], ...] = ()
    pushes: Pushes | None = None

    @property
    def goals(self) -> list[Array]:
        """The desired positions of points, (3,) [m] each."""
        wanted = [self.desired, *(goal for _, goal in self.moved)]
        return [goal for goal in wanted if goal is not None]

    @property
    def tips(self) -> list[Array]:
        """The points with a trace: those that listed tasks move, or the end effector, (3,) [m]."""
        return [place for place, _ in self.moved] or [self.points[-1]]


def of_scene(scene: Scene, f: int) -> Moment:
    """Return frame f of a recorded run."""
    linked = int(scene.linked[f])
    order = scene.orders[scene.order[f]]
    levels, columns = scene.levels, [scene.levels.names.index(name) for name in order]
    return Moment(
        float(scene.t[f]), scene.placements[f], scene.points[f],
        _where_finite(scene.nearest[f, linked]), linked, int(scene.active[f]), scene.centres[f],
        scene.axis[f], None if scene.desired is None else scene.desired[f], order,
        {name: Became(Fate(levels.fate[f, column]), float(levels.violation[f, column]),
                      levels.units[column])
         for name, column in zip(order, columns, strict=True)}, levels.saturated[f],
        tuple((path.actual[f], None if path.wanted is None else path.wanted[f])
              for path in scene.paths), scene.pushes.at(f) if scene.pushes else None)


def _where_finite(point: Array) -> Array | None:
    return point if np.isfinite(point).all() else None
