"""Distances of the true arm to the true obstacles, where a sensor measures others."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from hierarchy.state import State
from scenarios.cell.build import Cell
from scenarios.cell.sensors import ExactDistances


@final
class Truth:
    """Measures the true distances of every tick, after the tick was timed.

    The true joints are the plant's `true_q`, or those of the controller where no sensor comes
    between. The true obstacles are those of the scene, dragged or placed by a fault as they are.
    """

    def __init__(self, cell: Cell, ticks: int) -> None:
        assert cell.sensor is not None
        self._exact = ExactDistances(cell.robot, cell.sensor.obstacles)
        self._state, self._at_rest = State(cell.robot), np.zeros(cell.robot.n)
        self._distance = np.full((ticks, len(self._exact.points)), np.nan)

    def look(self, tick: int, t: float, q: Array) -> None:
        """Measure at time t [s] with the joints truly at q (nq,)."""
        if self._state.move(t, q, self._at_rest):
            self._distance[tick] = self._exact.measure(self._state).distance

    def signals(self, ticks: int) -> dict[str, NDArray[Any]]:
        """Return the signals true_* of distances of the first `ticks` ticks."""
        distance = self._distance[:ticks].copy()
        return {"true_control_point_distance": distance[:, :-1],
                "true_minimal_distance": distance[:, :-1].min(axis=1),
                "true_ee_distance": distance[:, -1]}


def truth_of(cell: Cell, ticks: int) -> Truth | None:
    """Return what measures true distances, None where the sensor itself does, or none are known.

    The obstacles in recorded frames are not known.
    """
    kind = cell.scenario.sensor.kind
    apart = kind != "exact" or "true_q" in cell.plant.extra
    return Truth(cell, ticks) if cell.sensor and apart and kind != "frames" else None
