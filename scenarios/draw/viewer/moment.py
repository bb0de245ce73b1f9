"""What is drawn at one moment, of a recorded frame or of a running controller."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy import State
from hierarchy.allocation import AVOIDANCE
from hierarchy.avoidance import Obstacles
from hierarchy.problem import Array
from scenarios.cell.sensors import ExactDistances
from scenarios.measure.judging import Judged, judged
from scenarios.recording import listed
from scenarios.recording.facts import facts_of
from scenarios.recording.fate import Fate, row_units
from scenarios.scene import SEPARATION, Scene
from scenarios.scene.pushes import Pushes, pushes

if TYPE_CHECKING:
    from scenarios.loop.controller import Controller


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


class Watched:
    """A running controller, observed between two ticks.

    Distances are measured again from known geometry at the true joints, even if the controller uses
    a camera. After `moment`, `listed` has the signals of listed tasks, one row each; see
    scenarios.recording.listed.
    """

    def __init__(self, controller: Controller) -> None:
        self.controller, self.listed = controller, dict[str, Array]()
        cell = controller.cell
        self._state, self._at_rest = State(cell.robot), np.zeros(cell.robot.n)
        obstacles = cell.sensor.obstacles if cell.sensor else Obstacles()
        self._exact = ExactDistances(cell.robot, obstacles)
        self._tip = cell.robot.frame(cell.robot.end_effector)
        self._facts = facts_of(cell.scenario, cell.robot)

    def moment(self) -> Moment:
        """Return what is drawn after the last tick: the state at its start."""
        controller, cell, seen = self.controller, self.controller.cell, self._exact.measurement
        q = cell.plant.extra.get("true_q", cell.state.q)
        self._state.move(cell.state.t, np.asarray(q), self._at_rest)
        self._exact.measure(self._state)
        order = controller.allocation.order
        found = self._judged()
        became = {name: Became(Fate(fate), violation, unit) for name, fate, violation, unit in zip(
            order, found.fate.tolist(), found.violation.tolist(),
            row_units(cell.scenario, order), strict=True)}
        active, linked = self._active(became), int(np.argmin(seen.distance))
        linked = active if active >= 0 else linked
        D = seen.distance[linked]
        nearest = seen.points[linked] - D * seen.direction[linked] if D < np.inf else None
        return Moment(
            cell.state.t, self._state.placements.copy(), seen.points.copy(), nearest, linked,
            active, self._exact.obstacles.centres.copy(), self._state.rotation(self._tip)[:, 2],
            cell.position.path(cell.state.t)[0] if cell.position else None, order, became,
            found.saturated, tuple(self._moved()), self._pushes())

    def _pushes(self) -> Pushes | None:
        controller, cell = self.controller, self.controller.cell
        if cell.contacts is None or not controller.answered or not self._facts.contacts:
            return None
        forces, com = cell.contacts.forces(controller.resolution.x), cell.plant.extra.get("com")
        return pushes(self._facts, cell.scenario, np.array([cell.state.t]),
                      self._state.placements[None], forces[None],
                      None if com is None else com[None]).at(0)

    def _active(self, became: Mapping[str, Became]) -> int:
        """Return the point that avoidance acts on, as `active` of `scenarios.scene.Scene`."""
        cell = self.controller.cell
        if cell.sensor is None:
            return -1
        if SEPARATION in became:
            idle = became[SEPARATION].fate is Fate.FREE
            return -1 if idle else int(self._exact.measurement.distance.argmin())
        return cell.sensor.measurement.active if AVOIDANCE in became else -1

    def _moved(self) -> Iterator[tuple[Array, Array | None]]:
        state, cell = self._state, self.controller.cell
        if not cell.listed:
            return
        self.listed = listed.signals(cell.robot, cell.listed, np.array([state.t]),
                                     state.q[None], state.v[None])
        for section in cell.scenario.tasks:
            here = self.listed.get(listed.position_of(section.title))
            if here is not None:
                error = self.listed[listed.error_of(section.title)]
                yield here[0], section.wanted(here[0], error[0])

    def _judged(self) -> Judged:
        controller = self.controller
        if not controller.answered:
            levels = len(controller.allocation.order)
            return Judged(np.full(levels, Fate.UNKNOWN, np.int8), np.full(levels, np.nan),
                          np.zeros(controller.cell.robot.n, np.int8))
        return judged(controller.cell, controller.hierarchy, controller.meant,
                      controller.resolver.accuracy)


def _where_finite(point: Array) -> Array | None:
    return point if np.isfinite(point).all() else None
