"""The controls of a live run, its stack list and its curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hierarchy.errors import HierarchyError
from scenarios.config import Scenario
from scenarios.draw.viewer.handles import Handles
from scenarios.draw.viewer.knobs import knobs
from scenarios.draw.viewer.playback import PlayButton, Requests, add_speed
from scenarios.draw.viewer.plots import Plots
from scenarios.draw.viewer.server import add_dark, lay_out

_CURVE = "#1c86c7"  # on light and dark pages


class LivePanel:
    """The panels of a live run; every input goes into `requests`.

    They request ("toggle", None), ("restart", None), ("speed", x), ("resolver", label), ("handles",
    shown), (dotted key, value), and what `Handles` does. The inputs are `choice` and `sliders` by
    key. `key` says in HTML what lines mean; the floor is at the height `floor` [m].
    """

    def __init__(self, server: Any, requests: Requests, scenario: Scenario, labels: Sequence[str],
                 curves: Any, speed: float, *, obstacles: int, floor: float, key: str = "") -> None:
        gui = server.gui
        with lay_out(server):
            self._plots = Plots(gui, {"run": curves}, {"run": _CURVE}, rolling=True)
        gui.add_markdown(f"**{scenario.title or scenario.name}**")
        self._button = PlayButton(gui, requests)
        requests.when_pressed(gui.add_button("Restart", icon="player-skip-back", color="gray"),
                              "restart")
        add_speed(gui, requests, speed)
        self.choice = gui.add_dropdown("Resolver", list(labels), initial_value=labels[0])
        requests.when_changed(self.choice, "resolver")
        gui.add_markdown("**Stack**, most important first")
        self._stack = gui.add_html("")
        if key:
            gui.add_html(key)
        with gui.add_folder("Settings"):
            shown = gui.add_checkbox("Handles to drag", initial_value=True)
            requests.when_changed(shown, "handles")
            add_dark(server, floor)
            self.sliders = {knob.key: gui.add_slider(
                knob.label, 0.0, max(knob.high, value), knob.step, value, hint=knob.key)
                for knob, value in knobs(scenario)}
        for key, slider in self.sliders.items():
            requests.when_changed(slider, key)
        self.handles = Handles(server, requests, obstacles, scenario.position is not None)

    def show(self, playing: bool, stack: str) -> None:
        """Show whether the run is playing, and the stack list."""
        self._button.show(playing)
        if stack != self._stack.content:
            self._stack.content = stack

    def roll(self, curves: Any) -> None:
        """Show the curves of the last seconds."""
        self._plots.roll({"run": curves})

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
