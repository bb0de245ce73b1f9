"""What is computed after each tick, outside the measured times, and becomes signals of a run."""

from collections.abc import Callable, Mapping
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.problem import Hierarchy
from hierarchy.state import State
from scenarios.cell.build import Cell
from scenarios.cell.sensors import ExactDistances
from scenarios.loop.controller import Controller
from solvers import Resolution, Status, certify
from solvers.resolution import SaturatedResolution
from solvers.resolver import Around
from solvers.resolvers.settled import Settled
from solvers.status import EQUAL, FREE

Row = tuple[str, int, int]  # task, row of the task, side: 1 upper, -1 lower
Signals = Mapping[str, ArrayLike]
Audit = Callable[[int, Controller], Signals]
"""Examines a tick that the controller has just answered; returns its values of signals by name.

The first value of a signal decides its type. One that is no signal, that the loop records or that
has another shape ends the run.
"""


@final
class Truth:
    """Distances of the true arm to the true obstacles, where a sensor measures others; an Audit.

    The true joints are the plant's `true_q`, or those of the controller where no sensor comes
    between. The true obstacles are those of the scene, dragged or placed by a fault as they are;
    those in recorded frames are not known.
    """

    def __init__(self, cell: Cell) -> None:
        kind, sensor, self._exact = cell.scenario.sensor.kind, cell.sensor, None
        if sensor and kind != "frames" and (kind != "exact" or "true_q" in cell.plant.extra):
            self._exact = ExactDistances(cell.robot, sensor.obstacles)
            self._state, self._at_rest = State(cell.robot), np.zeros(cell.robot.n)

    def __call__(self, tick: int, controller: Controller) -> Signals:
        """Return true_* of distances, answered or not; nothing where the sensor measures them."""
        cell = controller.cell
        if self._exact is None or not self._state.move(
                cell.state.t, np.asarray(cell.plant.extra.get("true_q", cell.state.q)),
                self._at_rest):
            return {}
        distance = self._exact.measure(self._state).distance
        return {"true_control_point_distance": distance[:-1],
                "true_minimal_distance": distance[:-1].min(), "true_ee_distance": distance[-1]}


@final
class ActiveSets:
    """Numbers the sets of acting inequality rows in the order in which they first occur; an Audit.

    A row is known by its task, its place in the task and the side at which it acts, so that a
    change of the stack is no change of the set unless rows that act come or go. Of a resolver that
    reports saturated unknowns, these are the rows. A set is unknown, -1, unless the resolver
    solved the tick and reports it.
    """

    def __init__(self) -> None:
        self._numbers: dict[frozenset[Row], int] = {}
        self._seen: dict[tuple[object, ...], int] = {}  # by stack and row states

    def __call__(self, tick: int, controller: Controller) -> Signals:
        """Return `active_set` of a tick, nothing before any is known."""
        number = self.number(controller.hierarchy, controller.resolution)
        return {"active_set": np.int32(number)} if self._numbers else {}

    def number(self, h: Hierarchy, resolution: Resolution) -> int:
        """Return the number of the set of an answer."""
        bounds, states = False, resolution.active
        if isinstance(resolution, SaturatedResolution):
            bounds, states = True, resolution.saturated
        if states is None or resolution.status is not Status.SOLVED:
            return -1
        key = h.names, bounds, states.tobytes()
        if key not in self._seen:
            acting = set[Row]()
            for i in np.flatnonzero((states != FREE) & (states != EQUAL)).tolist():
                # unknowns are as rows of the first level with any
                level = int(np.argmax(h.sizes > 0)) if bounds else int((h.offsets[1:] <= i).sum())
                acting.add((h.names[level], i if bounds else i - int(h.offsets[level]),
                            int(states[i])))
            self._seen[key] = self._numbers.setdefault(frozenset(acting), len(self._numbers))
        return self._seen[key]


def certify_tick(tick: int, controller: Controller) -> Signals:
    """Whether `solvers.certify` accepts the answer, to what the resolver was asked in the end."""
    h, resolver, found = controller.hierarchy, controller.resolver, controller.resolution
    if isinstance(resolver, Around) and not isinstance(resolver, Settled):
        resolver = resolver.inner  # that which faults are around
    if isinstance(resolver, Settled) and h.plain:
        h = resolver.asked(h)
    if h.giving and found.witnesses is None:  # the solve has failed before
        return {"certified": False}
    return {"certified": certify(h, found.x, witnesses=found.witnesses).certified}


@final
class Strictness:
    """How far [m] the levels below the position move the end effector in one tick; an Audit.

    Zero for a strict resolver. The tick is solved a second time without the lower levels and
    without the null-space task; NaN where either solve fails.
    """

    def __init__(self) -> None:
        self._memory: Any = None
        self._of: Controller | None = None  # whose resolver has made the memory

    def __call__(self, tick: int, controller: Controller) -> Signals:
        """Solve a tick without the levels below the position; return `moved_by_lower` [m]."""
        if controller is not self._of:
            self._of, self._memory = controller, None
        h, control = controller.hierarchy, controller.cell.scenario.control
        level = h.names.index("position")
        rows = slice(h.offsets[level], h.offsets[level + 1])
        alone = controller.resolver.solve(
            h.upper_part(level + 1).changed(reference=None, metric=None), self._memory)
        self._memory = alone.memory
        if not alone.status is controller.resolution.status is Status.SOLVED:
            return {"moved_by_lower": np.nan}
        moved = h.A[rows] @ (controller.resolution.x - alone.x)
        share = control.period if control.level == "velocity" else control.period**2 / 2
        return {"moved_by_lower": float(np.linalg.norm(moved)) * share}
