"""How well a run does what its avoidance task asks, and how abruptly the repulsion turns."""

from collections.abc import Mapping
from typing import Any, final

import numpy as np

from benchmark.tick import jacobians
from hierarchy.problem import Array
from scenarios.config import Scenario
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate
from scenarios.measure.metric import Metric
from scenarios.measure.metrics import measure
from scenarios.recording.recording import Recording

_FAR = 0.15               # [m] eps_2 of the letter: within it avoidance is asked for
_TURN = np.cos(np.radians(5.0))  # of a direction in a tick, from which on it is abrupt


@final
class Repulsion:
    """Follows the control point nearest to an obstacle in every tick; an Audit without signals.

    errors : n^T (J a + dJ v) - r of (29) [m/s^2] in ticks in which the point is within eps_2.
    jumps : how often the direction n of one point turned by more than 5 degrees in a tick.
    """

    def __init__(self) -> None:
        self.errors, self.jumps = list[float](), 0
        self._before: tuple[int, Array] | None = None

    def __call__(self, tick: int, controller: Controller) -> Mapping[str, Any]:
        """Examine a tick."""
        seen, state = controller.cell.sensor.measurement, controller.cell.state  # type: ignore[union-attr]
        k = seen.active
        if k < 0 or seen.distance[k] > _FAR:
            self._before = None
            return {}
        n = np.array(seen.direction[k])
        if self._before is not None and self._before[0] == k:
            self.jumps += int(n @ self._before[1] < _TURN)
        self._before = k, n
        if controller.level == "acceleration":
            joint = controller.cell.robot.control_points[k].joint
            J, dJ = jacobians(state, joint, seen.points[k])
            self.errors.append(float(n @ (J @ controller.sent + dJ @ state.v) - seen.magnitude[k]))
        return {}


def measured(scenario: Scenario) -> tuple[Recording, tuple[Metric, ...]]:
    """Return the recording of a run and its metrics, with those of this module."""
    watch = Repulsion()
    watched = [watch] if scenario.avoidance is not None and scenario.sensor.kind == "exact" else []
    recording = simulate(scenario, audits=watched)
    found = [*measure(recording).values(),
             Metric("speed_rms", "Joint speed, rms", _rms(recording["v"]), "rad/s"),
             Metric("acceleration_rms", "Joint acceleration, rms", _rms(recording["a"]),
                    "rad/s^2")]
    if watched:
        found += [Metric("avoidance_error_rms", "Error of the avoidance task, rms",
                         _rms(np.array(watch.errors)), "m/s^2"),
                  Metric("direction_jumps", "Abrupt turns of the repulsion",
                         float(watch.jumps), "")]
    return recording, tuple(found)


def _rms(values: Array) -> float | None:
    """Return the root of the mean square; None of no values."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else None
