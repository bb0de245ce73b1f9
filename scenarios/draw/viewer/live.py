"""A run that is changed by hand while it goes on; nothing here depends on a page."""

import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from scenarios.cell.build import build
from scenarios.config import Scenario, ScenarioError
from scenarios.config.sections.plant import KinematicSection
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import rehearsed, tick, watching
from scenarios.measure.judging import Fates, completed
from scenarios.measure.verdict import verdict
from scenarios.recording.recording import Recording
from scenarios.scene.drawn import Scene, scene

HAND = 1.0      # [m/s] greatest speed of a dragged obstacle or path
_FARTHEST = 5.0  # [m] greatest distance of dragging


class Live:
    """One run, tick by tick, in the thread that calls it.

    `scenario` has the present settings, `begun` those of the first tick. A change of tasks or
    resolver takes effect with the next tick, with the plant as it is. An invalid change raises a
    HierarchyError and has no effect. `over` is set after the last tick or after one with a `fault`.
    """

    _frame: Scene

    def __init__(self, scenario: Scenario) -> None:
        if scenario.faults:
            raise ScenarioError(f"scenario {scenario.name!r}: a live run injects no [[faults]]")
        rehearsed(scenario)
        self.scenario = self._first = scenario
        self.restart()

    def restart(self) -> None:
        """Start again with the present settings; obstacles return to their places."""
        control = self.scenario.control
        self.begun, self.over = self.scenario, False
        self.fault: str | None = None
        self.controller = Controller(build(self.scenario))
        self.ticks = control.ticks
        self.recorder, self._fates = watching(self.controller, self.ticks)
        self.changes: list[dict[str, Any]] = []
        sensor = self.controller.cell.sensor
        self.obstacles = sensor.obstacles if sensor else None
        offset = np.zeros((0, 3)) if self.obstacles is None else self.obstacles.offset
        self._wanted, self._changed = offset.copy(), np.zeros(self.ticks, dtype=np.bool_)
        self._offsets = np.zeros((self.ticks, *offset.shape))
        self._goals: tuple[int, float, dict[str, list[Any]]] = 0, 0.0, {}
        self._seen: tuple[int, Controller | None] = -1, None

    @property
    def t(self) -> float:
        """Time [s] of the next tick."""
        return self.recorder.ticks * self.scenario.control.period

    def tick(self) -> None:
        """Run the next tick, if there is one."""
        if self.over:
            return
        k = self.recorder.ticks
        self._drag_on()
        broken = tick(self.controller, self.recorder, self.t)
        self._changed[k] = self.scenario != self.begun or self._offsets[k].any()
        policy = self.controller.policy
        if broken:
            self.fault = f"{broken} from tick {k} on"
        elif policy.stopped:
            self.fault = policy.fault
        self.over = self.fault is not None or k + 1 == self.ticks

    def change(self, changes: Mapping[str, Any]) -> None:
        """Change the values of dotted keys of the scenario."""
        self._take_over(self.scenario.with_changes(changes), changes)

    def switch(self, spec: str) -> None:
        """Continue with another resolver, "name" or "name:setting=value"."""
        control = self._first.with_resolver(spec).control  # without the settings of an earlier spec
        scenario = self.scenario.with_changes({"control.resolver": control.resolver,
                                               "control.options": control.options})
        resolver = scenario.make_resolver()
        if not resolver.can_resolve(scenario.asks):
            raise ScenarioError(f"{spec} cannot resolve the {scenario.asks} of this stack")
        self._take_over(scenario, {"control.resolver": spec})

    def drag(self, h: int, offset: ArrayLike) -> None:
        """Move obstacle h to `offset` (3,) [m] from its place or path, at limited speed."""
        wanted = np.asarray(offset, dtype=float)
        if not 0 <= h < len(self._wanted):
            raise ScenarioError(f"there is no obstacle {h + 1}, only {len(self._wanted)}")
        if wanted.shape != (3,) or not np.linalg.norm(wanted) <= _FARTHEST:
            raise ScenarioError(f"obstacle {h + 1}: an offset of {wanted.tolist()} m is not three "
                                f"numbers within {_FARTHEST:g} m")
        self._wanted[h] = wanted

    @property
    def ending(self) -> str | None:
        """Why the run did not reach its end, or None if it did."""
        return self.fault if self.over else f"interrupted at tick {self.recorder.ticks}"

    def recording(self) -> Recording:
        """Return the run so far, including dragged obstacles and whether anything was changed."""
        ticks = self.recorder.ticks
        recording = self.recorder.finish(self.begun, self.ending)
        if self._changed[:ticks].any():
            recording.signals["changed"] = self._changed[:ticks]
            recording.signals["obstacle_offset"] = self._offsets[:ticks]
        exact = self.begun.model_copy(update={"plant": KinematicSection()})
        return completed(recording, build(exact), self._fates)

    def frame(self) -> Scene:
        """Return what is drawn after the last tick, one frame: the state at its start."""
        k, controller = self.recorder.ticks - 1, self.controller
        if self._seen == (k, controller):
            return self._frame
        self._seen = k, controller
        recording = self.recorder.part(np.array([k]), self.scenario)
        order = recording.orders[int(recording["order"][0])]
        recording.signals["order"][:] = 1
        recording = replace(recording, orders=(" > ".join(controller.cell.stack.names), order))
        fates = Fates(recording.task_names, 1, controller.cell.robot.n)
        if controller.answered:
            fates.look(0, controller)
        recording.signals.update(fates.signals(recording), obstacle_offset=self._offsets[k:k + 1])
        with suppress(HierarchyError):  # a state that is not finite cannot be drawn
            self._frame = scene(recording)
        return self._frame

    def goals(self, age: float) -> dict[str, list[Any]]:
        """Return how far the run is, or how it ended, and its goals so far: `Verdict.on_page`.

        They may be `age` [s] old, as a run of 20,000 ticks is judged in 30 ms.
        """
        ticks, now = self.recorder.ticks, time.monotonic()
        if ticks != self._goals[0] and now >= self._goals[1] + age:
            so_far = self.recorder.finish(self.begun, self.fault if self.over else None)
            self._goals = ticks, now, verdict(so_far).on_page()
        return self._goals[2]

    def _take_over(self, scenario: Scenario, changes: Mapping[str, Any]) -> None:
        """Continue with another scenario of the same robot and plant."""
        before = self.controller.cell
        measurement = before.state.measurement
        try:
            controller = Controller(build(scenario, before))
        except HierarchyError:
            before.state.measurement = measurement
            raise
        controller.follow(self.controller)
        self.scenario = scenario
        if not self.over:  # what is seen after the end stays; a restart takes the new settings
            self.controller = controller
            self.recorder.follow(controller)
            self.changes += [{"t": self.t, "key": key, "value": value}
                             for key, value in changes.items()]

    def _drag_on(self) -> None:
        """Move dragged obstacles by one tick toward their targets."""
        if self.obstacles is None:
            return
        step, offset = HAND * self.scenario.control.period, self.obstacles.offset
        for h in np.flatnonzero((self._wanted != offset).any(axis=1)).tolist():
            self.obstacles.shift(h, toward(offset[h], self._wanted[h], step))
        self._offsets[self.recorder.ticks] = self.obstacles.offset


def toward(here: Array, wanted: Array, most: float) -> Array:
    """Return the place [m] that is at most `most` [m] from here on the way to where it is to go."""
    length = float(np.linalg.norm(wanted - here))
    return wanted if length <= most else here + (wanted - here) * (most / length)
