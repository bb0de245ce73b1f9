"""A live run on a page: drawn while it goes on, with everything that can be changed."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from scenarios.config import Scenario
from scenarios.drawing import INK, colours
from scenarios.scene import stage
from scenarios.viewer.curves import Lately
from scenarios.viewer.handles import Handles
from scenarios.viewer.knobs import knobs
from scenarios.viewer.live import Live
from scenarios.viewer.model import Model, rgb
from scenarios.viewer.moment import Moment, Watched
from scenarios.viewer.playback import PlayButton, Requests, add_speed
from scenarios.viewer.plots import Plots
from scenarios.viewer.server import lay_floor, lay_out, look_at
from scenarios.viewer.stack_list import stack_html

FRAMES = 30.0     # drawn a second
_CURVES = 4.0     # times a second that the curves are drawn anew
_LATELY = 10.0    # [s] that the curves show
_TRACE = 600      # frames that the trace is long
_BUSY = 0.05      # [s] of ticks between two drawings, at most
_REACH = 0.75     # [m] about the base that the camera sees at least
_TARGET = 1.0     # [m/s] at most, of a path that is dragged


class LivePage:
    """A live run drawn into a server. `step` makes the ticks that are due, does what was asked for
    on the page before them, and draws.

    Public for tests: `requests`, `list` (the stack's HTML), `refused` (the last refusal).
    """

    def __init__(self, server: Any, live: Live, speed: float = 1.0) -> None:
        self.server, self.live, self.requests = server, live, Requests()
        self.speed, self.playing, self.restarted = speed, True, False
        self.list, self.refused = "", ""
        self.specs = resolvers(live.scenario)
        self._colours = colours(self.specs)
        self._due = 0.0
        self._stage = stage(live.scenario)
        self._path_wanted = np.array(self._path_offset())
        lay_floor(server, self._stage.floor)
        self._watched, self._lately = Watched(live.controller), Lately(int(_LATELY * FRAMES))
        self._trace: deque[tuple[Array, tuple[int, int, int]]] = deque(maxlen=_TRACE)
        self._model = Model(server, "/run", self._stage, self._colour, self._path())
        self._camera()
        self._first_tick()
        self._panel()
        self._curves_at = -np.inf
        self.draw()

    @property
    def label(self) -> str:
        """The resolver's label as it is now."""
        return str(self.live.scenario.make_resolver().label)

    def step(self, seconds: float) -> None:
        """Do what was asked for, then the ticks of so many seconds, and draw."""
        for what, value in self.requests.take():
            self._do(what, value)
        if self.playing and not self.live.over:
            self._drag_path(seconds)
            self._make_ticks(seconds)
        self.draw()

    def draw(self) -> None:
        """Show the run as it is."""
        now = self._watched.moment()
        with self.server.atomic():
            points, shades = zip(*self._trace, strict=True) if self._trace else ((), ())
            self._model.show(now, np.array(points).reshape(-1, 3), colours=np.array(shades))
            self._show_handles(now)
        self._show_list(now)
        self._button.show(self.playing and not self.live.over)
        if time.monotonic() - self._curves_at > 1.0 / _CURVES:
            self._curves_at = time.monotonic()
            self._plots.roll({"run": self._lately.curves(self.live.controller)})

    def _make_ticks(self, seconds: float) -> None:
        """Catch up with the clock as far as there is time; what cannot be caught up is left."""
        live, period = self.live, self.live.scenario.control.period
        self._due = min(self._due + self.speed * seconds / period,
                        self.speed * 2.0 / (FRAMES * period) + 1.0)
        end = time.perf_counter() + _BUSY
        while self._due >= 1.0 and not live.over and time.perf_counter() < end:
            live.tick()
            self._due -= 1.0
        self._note()

    def _first_tick(self) -> None:
        """There is something to show after a tick, not before."""
        self.live.tick()
        self._note()

    def _note(self) -> None:
        now = self._watched.moment()
        self._trace.append((now.points[-1], rgb(self._colour)))
        self._lately.add(self.live.controller)

    def _do(self, what: str, value: Any) -> None:
        try:
            if what == "toggle":
                self._toggle()
            elif what == "restart":
                self._restart()
            elif what == "speed":
                self.speed = value
            elif what == "handles":
                self._handles.set_visible(value)
            elif what == "path":
                self._path_wanted = value - self._middle
            elif what.startswith("obstacle "):
                self._drag(int(what.removeprefix("obstacle ")), value)
            elif what == "resolver":
                self.live.switch(self.specs[value])
                self._follow()
            else:
                self.live.change({what: value})
                self._follow()
        except HierarchyError as error:
            self._refuse(str(error))

    def _toggle(self) -> None:
        if self.live.over:
            self._restart()
        else:
            self.playing = not self.playing

    def _restart(self) -> None:
        self.restarted = True
        self.live.restart()
        self._trace.clear()
        self._lately.clear()
        self._due, self.playing = 0.0, True
        self._follow()
        self._first_tick()

    def _drag(self, h: int, place: Array) -> None:
        obstacles = self.live.obstacles
        if obstacles is not None:
            self.live.drag(h, place - (obstacles.centres[h] - obstacles.offset[h]))

    def _drag_path(self, seconds: float) -> None:
        """Bring the path nearer to where it is dragged."""
        here = np.array(self._path_offset())
        way = self._path_wanted - here
        length = float(np.linalg.norm(way))
        if length > 0.0:
            step = min(1.0, _TARGET * seconds / length)
            self._do("position.offset", (here + step * way).tolist())
            if (here == self._path_offset()).all():  # refused
                self._path_wanted = here

    def _follow(self) -> None:
        """Draw what has changed with the scenario."""
        self._watched = Watched(self.live.controller)
        fresh = stage(self.live.scenario)
        if (fresh.areas, fresh.half_angle) != (self._stage.areas, self._stage.half_angle):
            self._model.set_stage(fresh)
        self._stage = fresh
        self._model.paint(self._colour)
        self._model.set_path(self._path())
        self._choice.value = self._chosen

    def _refuse(self, why: str) -> None:
        """Say why something was not done, and put the sliders back to what is so."""
        self.refused = why
        for client in self.server.get_clients().values():
            client.add_notification("Not changed", why, color="red", auto_close_seconds=6.0)
        for knob, value in knobs(self.live.scenario):
            self._sliders[knob.key].value = value
        self._choice.value = self._chosen

    @property
    def _chosen(self) -> str:
        return self.label if self.label in self.specs else next(iter(self.specs))

    @property
    def _colour(self) -> str:
        return self._colours.get(self.label, INK)

    def _path_offset(self) -> tuple[float, float, float]:
        position = self.live.scenario.position
        return (0.0, 0.0, 0.0) if position is None else position.offset

    def _path(self) -> Array | None:
        """The desired path over the run, (N, 3) [m]; `_middle` is that of it without its offset."""
        position = self.live.controller.cell.position
        if position is None:
            return None
        times = np.linspace(0.0, self.live.scenario.control.duration, _TRACE)
        path = np.array([position.path(t)[0] for t in times])
        self._middle = (path.min(axis=0) + path.max(axis=0)) / 2 - self._path_offset()
        return path

    def _camera(self) -> None:
        path = self._path()
        seen = [np.full((1, 3), -_REACH / 2), np.full((1, 3), _REACH / 2),
                self._stage.obstacles.centres, np.zeros((0, 3)) if path is None else path]
        points = np.vstack(seen)
        low, high = points.min(axis=0), points.max(axis=0)
        low[2] = max(low[2], self._stage.floor)
        look_at(self.server, (low + high) / 2, 0.42 * float(np.linalg.norm(high - low)))

    def _show_handles(self, now: Moment) -> None:
        for h, centre in enumerate(now.centres):
            self._handles.follow(f"obstacle {h}", centre)
        if now.desired is not None:
            self._handles.follow("path", self._middle + self._path_offset())

    def _show_list(self, now: Moment) -> None:
        live = self.live
        note = f"t = {now.t:.1f} of {live.ticks * live.scenario.control.period:.1f} s"
        if live.over:
            note += f", {live.fault or 'ended'}"
        html = stack_html(self.label, self._colour, now, live.controller.cell.stack.names, note)
        if html != self.list:
            self.list = self._stack.content = html

    def _panel(self) -> None:
        gui, requests, scenario = self.server.gui, self.requests, self.live.scenario
        with lay_out(self.server):
            self._plots = Plots(gui, {"run": self._lately.curves(self.live.controller)},
                                {"run": INK}, rolling=True)
        self._button = PlayButton(gui, requests)
        requests.when_pressed(gui.add_button("Restart", icon="player-skip-back", color="gray"),
                              "restart")
        add_speed(gui, requests, self.speed)
        self._choice = gui.add_dropdown("Resolver", list(self.specs), initial_value=self._chosen)
        requests.when_changed(self._choice, "resolver")
        gui.add_markdown("**Stack**, most important first")
        self._stack = gui.add_html("")
        self._sliders = {}
        with gui.add_folder("Settings"):
            shown = gui.add_checkbox("Handles to drag", initial_value=True)
            requests.when_changed(shown, "handles")
            for knob, value in knobs(scenario):
                slider = gui.add_slider(knob.label, 0.0, max(knob.high, value), knob.step, value,
                                        hint=knob.key)
                requests.when_changed(slider, knob.key)
                self._sliders[knob.key] = slider
        obstacles = self.live.obstacles
        self._handles = Handles(self.server, requests, len(obstacles) if obstacles else 0,
                                scenario.position is not None)


def resolvers(scenario: Scenario) -> dict[str, str]:
    """Return specs of the resolvers that can resolve a scenario's stack, by their labels.

    The scenario's own is the first.
    """
    from scenarios.compare import default_resolvers
    from solvers import names

    own = scenario.control.resolver
    found: dict[str, str] = {}
    for spec in (own, *default_resolvers(scenario.asks)[0], *names()):
        try:
            other = scenario if spec == own else scenario.with_resolver(spec)
            resolver = other.make_resolver()
        except HierarchyError:
            continue
        if resolver.can_resolve(other.asks):
            found.setdefault(str(resolver.label), spec)
    return found
