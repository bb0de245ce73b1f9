"""What is computed after each tick, outside the measured times, and becomes signals of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Hierarchy
from hierarchy.state import State
from scenarios.cell.build import Cell
from scenarios.cell.sensors import ExactDistances
from scenarios.config import Scenario
from scenarios.loop.controller import Controller
from scenarios.recording.recording import Recording
from solvers import Resolution, Resolver, Status, certify
from solvers.resolution import SaturatedResolution
from solvers.resolvers.settled import Settled
from solvers.status import EQUAL, FREE

Row = tuple[str, int, int]  # task, row of the task, side: 1 upper, -1 lower
Signals = Mapping[str, NDArray[Any]]


class Audit(Protocol):
    """Computes numbers in ticks that become signals of the Recording."""

    def look(self, tick: int, controller: Controller) -> None:
        """Examine the tick that the controller has just answered."""

    def signals(self, recording: Recording) -> Signals:
        """Return the signals by name, a row for each tick of the recording."""


@final
class Truth:
    """Distances of the true arm to the true obstacles, where a sensor measures others.

    The true joints are the plant's `true_q`, or those of the controller where no sensor comes
    between. The true obstacles are those of the scene, dragged or placed by a fault as they are;
    those in recorded frames are not known.
    """

    def __init__(self, ticks: int, cell: Cell) -> None:
        kind, sensor = cell.scenario.sensor.kind, cell.sensor
        self._exact, self._distance = None, np.empty((0, 0))
        if sensor and kind != "frames" and (kind != "exact" or "true_q" in cell.plant.extra):
            self._exact = ExactDistances(cell.robot, sensor.obstacles)
            self._state, self._at_rest = State(cell.robot), np.zeros(cell.robot.n)
            self._distance = np.full((ticks, len(self._exact.points)), np.nan)

    def look(self, tick: int, controller: Controller) -> None:
        """Measure at the joints of a tick, answered or not."""
        cell = controller.cell
        if self._exact is not None and self._state.move(
                cell.state.t, np.asarray(cell.plant.extra.get("true_q", cell.state.q)),
                self._at_rest):
            self._distance[tick] = self._exact.measure(self._state).distance

    def signals(self, recording: Recording) -> Signals:
        """Return the signals true_* of distances, none where the sensor itself measures them."""
        if self._exact is None:
            return {}
        distance = self._distance[:recording.ticks].copy()
        return {"true_control_point_distance": distance[:, :-1],
                "true_minimal_distance": distance[:, :-1].min(axis=1),
                "true_ee_distance": distance[:, -1]}


@final
class ActiveSets:
    """Numbers the sets of acting inequality rows in the order in which they first occur.

    A row is known by its task, its place in the task and the side at which it acts, so that a
    change of the stack is no change of the set unless rows that act come or go. Of a resolver that
    reports saturated unknowns, these are the rows. A set is unknown, -1, unless the resolver
    solved the tick and reports it.
    """

    def __init__(self, ticks: int) -> None:
        self._number = np.full(ticks, -1, dtype=np.int32)
        self._numbers: dict[frozenset[Row], int] = {}
        self._seen: dict[tuple[object, ...], int] = {}  # by stack and row states

    def look(self, tick: int, controller: Controller) -> None:
        """Note the set of a tick."""
        self.note(tick, controller.hierarchy, controller.resolution)

    def note(self, tick: int, h: Hierarchy, resolution: Resolution) -> None:
        """Note the set of an answer."""
        rows: Callable[[Hierarchy, NDArray[np.int8]], Iterator[Row]] = _rows
        states = resolution.active
        if isinstance(resolution, SaturatedResolution):
            rows, states = _bounds, resolution.saturated
        if states is None or resolution.status is not Status.SOLVED:
            return
        key = h.names, rows, states.tobytes()
        if key not in self._seen:
            acting = frozenset(rows(h, states))
            self._seen[key] = self._numbers.setdefault(acting, len(self._numbers))
        self._number[tick] = self._seen[key]

    def signals(self, recording: Recording) -> Signals:
        """Return `active_set`, nothing if no set is known."""
        return {"active_set": self._number[:recording.ticks].copy()} if self._numbers else {}


@final
class Certified:
    """Whether `solvers.certify` accepts the answer, to what the resolver was asked in the end."""

    def __init__(self, ticks: int) -> None:
        self._values = np.zeros(ticks, dtype=bool)

    def look(self, tick: int, controller: Controller) -> None:
        """Judge the answer of a tick."""
        h, resolver, found = controller.hierarchy, controller.resolver, controller.resolution
        if isinstance(resolver, Settled) and h.plain:
            h = resolver.asked(h)
        self._values[tick] = certify(h, found.x, witnesses=found.witnesses).certified

    def signals(self, recording: Recording) -> Signals:
        """Return `certified` (T,)."""
        return {"certified": self._values[:recording.ticks]}


@final
class Strictness:
    """How far [m] the levels below the position move the end effector in one tick.

    Zero for a strict resolver. The tick is solved a second time without the lower levels and
    without the null-space task; NaN where either solve fails.
    """

    def __init__(self, ticks: int, scenario: Scenario) -> None:
        self._values = np.full(ticks, np.nan)
        period = scenario.control.period
        self._share = period if scenario.control.level == "velocity" else period**2 / 2
        self._memory: Any = None

    def look(self, tick: int, controller: Controller) -> None:
        """Solve a tick without the levels below the position, and compare."""
        h, resolver = controller.hierarchy, controller.resolver
        level = h.names.index("position")
        rows = slice(h.offsets[level], h.offsets[level + 1])
        alone = self._resolve(resolver, h.upper_part(level + 1).changed(reference=None,
                                                                        metric=None))
        if alone is not None and controller.resolution.status is Status.SOLVED:
            moved = h.A[rows] @ (controller.resolution.x - alone)
            self._values[tick] = float(np.linalg.norm(moved)) * self._share

    def signals(self, recording: Recording) -> Signals:
        """Return `moved_by_lower` (T,) [m]."""
        return {"moved_by_lower": self._values[:recording.ticks]}

    def _resolve(self, resolver: Resolver, h: Hierarchy) -> NDArray[np.float64] | None:
        res = resolver.solve(h, self._memory)
        self._memory = res.memory
        return res.x if res.status is Status.SOLVED else None


def _rows(h: Hierarchy, active: NDArray[np.int8]) -> Iterator[Row]:
    """Yield the acting inequality rows; `active` (m,) as in a Resolution."""
    for i in np.flatnonzero((active != FREE) & (active != EQUAL)).tolist():
        level = int((h.offsets[1:] <= i).sum())
        yield h.names[level], i - int(h.offsets[level]), int(active[i])


def _bounds(h: Hierarchy, saturated: NDArray[np.int8]) -> Iterator[Row]:
    """Yield the saturated unknowns, as rows of the first level that has any."""
    bounds = h.names[int(np.argmax(h.sizes > 0))]
    for i in np.flatnonzero((saturated != FREE) & (saturated != EQUAL)).tolist():
        yield bounds, i, int(saturated[i])
