"""What is drawn at one moment: of a recording's frame, or of a controller that is at work."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy import State
from hierarchy.allocation import AVOIDANCE
from hierarchy.avoidance import Obstacles
from hierarchy.problem import Array
from scenarios.levels import Fate, fates, saturated, tolerance
from scenarios.scene import Scene
from scenarios.sensors import ExactDistances

if TYPE_CHECKING:
    from scenarios.controller import Controller


class Became(NamedTuple):
    """What became of a task, and the Euclidean norm of its violation in the unit of its rows."""

    fate: Fate
    violation: float


@dataclass(frozen=True)
class Moment:
    """What there is to draw at time t [s]; metres, arrays as in `scenarios.scene.Scene`.

    placements (J + 1, 12); points (P, 3), the end effector last; nearest (3,) the obstacle's point
    to link with point `linked`, or None; active, the point that the stack keeps away, or -1;
    centres (H, 3); axis (3,); desired (3,) or None; angle [rad] between the axis and that of the
    cone, or None. `order` names the tasks in the stack, most important first, `became` has each of
    them; saturated (n,) says which side -1 or 1 of its limits each joint is at.
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


def of_scene(scene: Scene, f: int) -> Moment:
    """Return frame f of a recorded run."""
    linked = int(scene.linked[f])
    order = scene.orders[scene.order[f]]
    levels, columns = scene.levels, [scene.levels.names.index(name) for name in order]
    return Moment(
        float(scene.t[f]), scene.placements[f], scene.points[f],
        _where_finite(scene.nearest[f, linked]), linked, int(scene.active[f]), scene.centres[f],
        scene.axis[f], None if scene.desired is None else scene.desired[f], order,
        {name: Became(Fate(levels.fate[f, column]), float(levels.violation[f, column]))
         for name, column in zip(order, columns, strict=True)}, levels.saturated[f])


class Watched:
    """A controller that is at work, looked at between two ticks.

    Distances are measured once more, from known geometry and at the true joints, also where the
    controller sees a camera's.
    """

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        cell = controller.cell
        self._state, self._at_rest = State(cell.robot), np.zeros(cell.robot.n)
        obstacles = cell.sensor.obstacles if cell.sensor else Obstacles()
        self._exact = ExactDistances(cell.robot, obstacles)
        self._tip = cell.robot.frame(cell.robot.end_effector)

    def moment(self) -> Moment:
        """Return what there is to draw after the last tick, as it was at its begin."""
        controller, cell, seen = self.controller, self.controller.cell, self._exact.measurement
        q = cell.plant.extra.get("true_q", cell.state.q)
        self._state.move(cell.state.t, np.asarray(q), self._at_rest)
        self._exact.measure(self._state)
        active, linked = self._active(), int(np.argmin(seen.distance))
        linked = active if active >= 0 else linked
        nearest = seen.points[linked] - seen.distance[linked] * seen.direction[linked]
        order = controller.allocation.order
        return Moment(
            cell.state.t, self._state.placements.copy(), seen.points.copy(),
            _where_finite(nearest), linked, active, self._exact.obstacles.centres.copy(),
            self._state.rotation(self._tip)[:, 2],
            cell.position.target[0].copy() if cell.position else None, order,
            self._became(order), self._saturated())

    def _active(self) -> int:
        """The point of an avoidance in the stack; of rows for all, the nearest that has some."""
        controller, cell = self.controller, self.controller.cell
        section = cell.scenario.avoidance
        if section is None or cell.sensor is None:
            return -1
        if section.kind == "separation":
            distance = self._exact.measurement.distance
            return int(distance.argmin()) if distance.min() < section.influence else -1
        asked = AVOIDANCE in controller.allocation.order
        return cell.sensor.measurement.active if asked else -1

    def _became(self, order: tuple[str, ...]) -> dict[str, Became]:
        controller = self.controller
        if not controller.answered:
            return dict.fromkeys(order, Became(Fate.UNKNOWN, np.nan))
        h, x = controller.hierarchy, controller.sent
        found = fates(h, x, self._tolerance())
        return {name: Became(*one)
                for name, *one in zip(order, found, h.violations(x).tolist(), strict=True)}

    def _saturated(self) -> NDArray[np.int8]:
        controller = self.controller
        if not controller.answered:
            return np.zeros(len(controller.sent), np.int8)
        return saturated(controller.cell, controller.hierarchy, controller.sent,
                         self._tolerance())

    def _tolerance(self) -> float:
        return tolerance(self.controller.resolver.accuracy, self.controller.sent)


def _where_finite(point: Array) -> Array | None:
    return point if np.isfinite(point).all() else None
