"""Curves of the last seconds of a live run."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np

from hierarchy.problem import Array
from scenarios.draw.viewer.moment import Watched
from scenarios.loop.controller import Controller
from scenarios.recording.facts import Facts
from scenarios.recording.recording import Recording
from scenarios.scene import Series, series


class Lately:
    """Keeps the last `length` moments; `curves` are like those of a recording."""

    def __init__(self, length: int, facts: Facts) -> None:
        self._facts = facts
        self._kept: deque[dict[str, Any]] = deque(maxlen=length)

    def clear(self) -> None:
        """Discard everything."""
        self._kept.clear()

    def add(self, watched: Watched) -> None:
        """Add the last tick of a watched controller, after its `moment`."""
        controller, cell = watched.controller, watched.controller.cell
        now: dict[str, Any] = {"t": cell.state.t, "v": cell.state.v.copy()}
        now |= {name: rows[0] for name, rows in watched.listed.items()}
        if cell.position is not None:
            now["position_error"] = (cell.position.path(cell.state.t)[0]
                                     - cell.state.position(cell.position.frame))
        if cell.pointing is not None:
            # without alpha_d, which may have changed when this is drawn
            now["pointing_error"] = controller.cone_error - cell.pointing.cos_alpha_d
        if cell.sensor is not None:
            seen = cell.sensor.measurement
            now |= {"minimal_distance": seen.minimal_distance,
                    "ee_distance": seen.end_effector_distance}
        if "floor_force" in cell.plant.extra:
            now["floor_force"] = cell.plant.extra["floor_force"].copy()
        if controller.level == "torque":
            now |= {"command": controller.sent.copy(), "torque_limit": cell.torque_limit}
        self._kept.append(now)

    def curves(self, controller: Controller) -> tuple[Array, tuple[Series, ...]]:
        """Return times (F,) [s] and curves."""
        signals = {name: np.array([now[name] for now in self._kept]) for name in self._kept[-1]}
        if controller.cell.pointing is not None:
            signals["pointing_error"] += controller.cell.pointing.cos_alpha_d
        recording = Recording(signals, (), controller.cell.scenario, self._facts)
        return signals["t"], tuple(series(recording, np.arange(len(self._kept))))
