"""The controls of a live run: sliders, handles to drag, its stack list and its curves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from scenarios.config import Scenario
from scenarios.draw.viewer.live import Live
from scenarios.draw.viewer.playback import PlayButton, Requests, add_speed
from scenarios.draw.viewer.plots import Plots
from scenarios.draw.viewer.server import add_dark, lay_out
from scenarios.scene import Stage


@dataclass(frozen=True)
class Knob:
    """A number in a scenario, by its dotted key, and the range of its slider."""

    key: str
    label: str
    high: float
    step: float

    def value(self, scenario: Scenario) -> float | None:
        """Return its value, or None where the scenario has no such number."""
        found: object = scenario
        for name in self.key.split("."):
            found = getattr(found, name, None)
        return float(found) if isinstance(found, int | float) else None


_BOTH = (
    Knob("pointing.alpha_d", "Cone, half angle [deg]", 90.0, 0.5),
    Knob("avoidance.near", "Body, near distance [m]", 0.4, 0.005),
    Knob("avoidance.far", "Body, far distance [m]", 0.4, 0.005),
    Knob("avoidance.end_effector", "End effector, distance [m]", 0.4, 0.005),
    Knob("avoidance.distance", "Distance kept [m]", 0.3, 0.005),
    Knob("avoidance.influence", "Influence from [m]", 0.8, 0.01),
    Knob("avoidance.rate", "Approach rate [1/s]", 40.0, 0.5),
    Knob("limits.acceleration", "Joint acceleration [rad/s²]", 40.0, 0.5),
    Knob("damping.value", "Joint damping [1/s]", 20.0, 0.1))
_ACCELERATION = (
    Knob("position.stiffness", "Path, stiffness [1/s²]", 200.0, 1.0),
    Knob("position.damping", "Path, damping [1/s]", 60.0, 0.5),
    Knob("pointing.stiffness", "Cone, stiffness [1/s²]", 100.0, 0.5),
    Knob("pointing.damping", "Cone, damping [1/s]", 40.0, 0.5))
_VELOCITY = (
    Knob("position.gain", "Path, gain [1/s]", 50.0, 0.5),
    Knob("pointing.gain", "Cone, gain [1/s]", 50.0, 0.5))


def knobs(scenario: Scenario) -> Iterator[tuple[Knob, float]]:
    """Yield the settings that apply to a scenario, with their values."""
    gains = _ACCELERATION if scenario.control.level == "acceleration" else _VELOCITY
    for knob in (*_BOTH, *gains):
        value = knob.value(scenario)
        if value is not None:
            yield knob, value


_SIZE = 0.13  # [m] of the arrows


class Handles:
    """Arrows at each obstacle and at the middle of the path, to move them.

    They request ("obstacle h", place (3,) [m]) and ("path", place). A handle that is not held
    follows its object.
    """

    def __init__(self, server: Any, requests: Requests, obstacles: int, path: bool) -> None:
        names = [f"obstacle {h}" for h in range(obstacles)] + ["path"] * path
        self._requests, self._held = requests, set[str]()
        self._handles = {name: self._add(server, name) for name in names}

    def follow(self, name: str, place: Array) -> None:
        """Move a handle to its place (3,) [m], unless it is held."""
        handle = self._handles.get(name)
        if handle is not None and name not in self._held and (handle.position != place).any():
            handle.position = place

    def set_visible(self, visible: bool) -> None:
        """Show or hide all handles."""
        for handle in self._handles.values():
            handle.visible = visible

    def _add(self, server: Any, name: str) -> Any:
        handle = server.scene.add_transform_controls(
            f"/handles/{name}", _SIZE, disable_rotations=True, depth_test=False, line_width=2.0)

        async def moved(event: Any) -> None:  # in order: start, updates, end
            if event.phase == "start":
                self._held.add(name)
            self._requests.put(name, np.array(event.target.position, dtype=float))
            if event.phase == "end":
                self._held.discard(name)

        handle.on_update(moved)
        return handle


_LATELY = 10.0     # [s] shown by the curves
_CURVE = "#1c86c7"  # on light and dark pages


class LivePanel:
    """The panels of a live run; every input goes into `requests`.

    They request ("toggle", None), ("restart", None), ("speed", x), ("resolver", label), ("handles",
    shown), (dotted key, value), and what `Handles` does. The inputs are `choice` and `sliders` by
    key. `key` says in HTML what lines mean.
    """

    def __init__(self, server: Any, requests: Requests, live: Live, labels: Sequence[str],
                 speed: float, stage: Stage, key: str = "") -> None:
        gui, scenario, self._live = server.gui, live.scenario, live
        with lay_out(server):
            self._plots = Plots(gui, {"run": live.curves(_LATELY)}, {"run": _CURVE}, rolling=True)
        gui.add_markdown(f"**{scenario.title or scenario.name}**")
        self._button = PlayButton(gui, requests)
        requests.when_pressed(gui.add_button("Restart", icon="player-skip-back", color="gray"),
                              "restart")
        add_speed(gui, requests, speed)
        self.choice = gui.add_dropdown("Resolver", list(labels), initial_value=labels[0])
        requests.when_changed(self.choice, "resolver")
        self._stack = gui.add_html("")
        if key:
            gui.add_html(key)
        with gui.add_folder("Settings"):
            shown = gui.add_checkbox("Handles to drag", initial_value=True)
            requests.when_changed(shown, "handles")
            add_dark(server, stage.floor)
            self.sliders = {knob.key: gui.add_slider(
                knob.label, 0.0, max(knob.high, value), knob.step, value, hint=knob.key)
                for knob, value in knobs(scenario)}
        for key, slider in self.sliders.items():
            requests.when_changed(slider, key)
        self.handles = Handles(server, requests, len(stage.obstacles),
                               scenario.position is not None)

    def show(self, playing: bool, stack: str) -> None:
        """Show whether the run is playing, and the stack list."""
        self._button.show(playing)
        if stack != self._stack.content:
            self._stack.content = stack

    def roll(self) -> None:
        """Show the curves of the last seconds."""
        self._plots.roll({"run": self._live.curves(_LATELY)})

    def set_to(self, scenario: Scenario, label: str) -> None:
        """Set every input to the present values."""
        self.choice.value = label
        for knob, value in knobs(scenario):
            self.sliders[knob.key].value = value


def resolvers(scenario: Scenario) -> dict[str, str]:
    """Return the specs of resolvers that can resolve a scenario's stack, by label.

    The scenario's own resolver is the first.
    """
    from scenarios.config.resolvers import default_resolvers
    from solvers import names, variants

    own = scenario.control.resolver
    found: dict[str, str] = {}
    for spec in (own, *default_resolvers(scenario.asks)[0], *names(), *variants()):
        try:
            other = scenario if spec == own else scenario.with_resolver(spec)
            resolver = other.make_resolver()
        except HierarchyError:
            continue
        if resolver.can_resolve(other.asks):
            found.setdefault(str(resolver.label), spec)
    return found
