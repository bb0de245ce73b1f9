"""A live run on a page, where it is drawn and changed."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array
from hierarchy.tasks import Position
from hierarchy.tasks.pose import PoseTask
from scenarios.draw.figures.drawing import colours
from scenarios.draw.viewer.live import Live
from scenarios.draw.viewer.live_panel import LivePanel, resolvers
from scenarios.draw.viewer.model import Model, Rgb, rgb
from scenarios.draw.viewer.moment import Moment
from scenarios.draw.viewer.playback import Requests
from scenarios.draw.viewer.server import lay_floor, look_at_all
from scenarios.draw.viewer.stack_list import key_html, stack_html
from scenarios.scene import Stage, ends, stage
from scenarios.scene.pushes import key

FRAMES = 30.0   # frames per second
_CURVES = 4.0   # updates of the curves per second
_TRACE = 600    # length of the trace in frames, points of the path
_BUSY = 0.05    # [s] of ticks between two frames, at most
_HAND = 1.0     # [m/s] greatest speed of a dragged path
_NEAR = 1.0     # [m] from the base: obstacles in the initial camera view


class LivePage:
    """A live run drawn into a server.

    `step` carries out requests, runs the ticks that are due, and draws; nothing else changes the
    run. `requests` takes the page's requests; `list` is the stack's HTML; `refused` says why the
    last invalid request was rejected.
    """

    def __init__(self, server: Any, live: Live, speed: float = 1.0) -> None:
        self.server, self.live, self.requests = server, live, Requests()
        self.speed, self.playing = speed, True
        self.list, self.refused = "", ""
        self.specs = resolvers(live.scenario)
        self._colours = colours(self.specs)
        self._due, self._curves_at = 0.0, -np.inf
        self._stage = self._stage_now()
        self._trace: deque[tuple[list[Array], Rgb]] = deque(maxlen=_TRACE)
        self._middle, self._path_wanted = np.zeros(3), self._path_offset()
        lay_floor(server, self._stage.floor)
        paths = self._paths()
        self._model = Model(server, "/run", self._stage, self._colour, paths)
        self._first_tick()
        self._place_camera(paths)
        self.panel = LivePanel(
            server, self.requests, live, list(self.specs), speed, self._stage,
            key_html(key(live.recorder.facts, live.scenario), self._colour))
        self.draw()

    @property
    def label(self) -> str:
        """The label of the present resolver."""
        return str(self.live.scenario.make_resolver().label)

    def step(self, seconds: float) -> None:
        """Carry out requests, run the ticks of so many seconds, and draw."""
        for what, value in self.requests.take():
            self._do(what, value)
        if self.playing and not self.live.over:
            self._drag_path(seconds)
            self._make_ticks(seconds)
        self.draw()

    def draw(self) -> None:
        """Draw the present state of the run."""
        now = self.live.moment()
        tips, shades = zip(*self._trace, strict=True)
        with self.server.atomic():
            self._model.show(now, list(np.swapaxes(tips, 0, 1)), np.array(shades))
            for h, centre in enumerate(now.centres):
                self.panel.handles.follow(f"obstacle {h}", centre)
            self.panel.handles.follow("path", self._middle + self._path_offset())
        self._show_list(now)
        if time.monotonic() - self._curves_at > 1.0 / _CURVES:
            self._curves_at = time.monotonic()
            self.panel.roll()

    def _make_ticks(self, seconds: float) -> None:
        """Run the ticks that are due as far as time allows; drop the rest."""
        live, a_second = self.live, self.speed / self.live.scenario.control.period
        self._due = min(self._due + a_second * seconds, a_second * 2.0 / FRAMES + 1.0)
        end = time.perf_counter() + _BUSY
        while self._due >= 1.0 and not live.over and time.perf_counter() < end:
            live.tick()
            self._due -= 1.0
        self._note()

    def _first_tick(self) -> None:
        """Run one tick, before which there is nothing to show."""
        self.live.tick()
        self._note()

    def _note(self) -> None:
        self._trace.append((self.live.moment().tips, rgb(self._colour)))

    def _do(self, what: str, value: Any) -> None:
        try:
            if what == "toggle" and not self.live.over:
                self.playing = not self.playing
            elif what in ("toggle", "restart"):
                self._restart()
            elif what == "speed":
                self.speed = value
            elif what == "handles":
                self.panel.handles.set_visible(value)
            elif what == "path":
                self._path_wanted = value - self._middle
            elif what.startswith("obstacle "):
                self._drag(int(what.removeprefix("obstacle ")), value)
            else:
                self._change(what, value)
        except HierarchyError as error:
            self._refuse(str(error))

    def _change(self, what: str, value: Any) -> None:
        if what == "resolver":
            self.live.switch(self.specs[value])
        else:
            self.live.change({what: value})
        self._follow()

    def _restart(self) -> None:
        self.live.restart()
        self._trace.clear()
        self._due, self.playing = 0.0, True
        self._follow()
        self._first_tick()

    def _drag(self, h: int, place: Array) -> None:
        obstacles = self.live.obstacles
        if obstacles is not None:
            self.live.drag(h, place - (obstacles.centres[h] - obstacles.offset[h]))

    def _drag_path(self, seconds: float) -> None:
        """Move the path toward its dragged place."""
        here = self._path_offset()
        way = self._path_wanted - here
        length = float(np.linalg.norm(way))
        if length > 0.0:
            step = min(1.0, _HAND * seconds / length)
            self._do("position.offset", (here + step * way).tolist())
            if (here == self._path_offset()).all():  # the change was rejected
                self._path_wanted = here

    def _follow(self) -> None:
        """Draw the parts that have changed with the scenario."""
        before, self._stage = self._stage, self._stage_now()
        if (before.areas, before.half_angle) != (self._stage.areas, self._stage.half_angle):
            self._model.set_stage(self._stage)
        self._model.paint(self._colour)
        self._model.set_paths(self._paths())

    def _stage_now(self) -> Stage:
        return stage(self.live.recorder.facts.robot, self.live.scenario)

    def _refuse(self, why: str) -> None:
        """Say why a request was rejected, and reset the inputs."""
        self.refused = why
        for client in self.server.get_clients().values():
            client.add_notification("Not changed", why, color="red", auto_close_seconds=6.0)
        self.panel.set_to(self.live.scenario, self.label)

    @property
    def _colour(self) -> str:
        return self._colours[self.label]

    def _path_offset(self) -> Array:
        position = self.live.scenario.position
        return np.array(position.offset) if position else np.zeros(3)

    def _paths(self) -> list[Array]:
        """Return the desired paths (N, 3) [m]; update `_middle`, that of the first one."""
        cell = self.live.controller.cell
        times = np.linspace(0.0, self.live.scenario.control.duration, _TRACE)
        paths = [np.array([task.path(t)[0] for t in times])
                 for task in (cell.position, *cell.listed) if isinstance(task, Position | PoseTask)]
        if cell.position is not None:
            self._middle = (paths[0].min(axis=0) + paths[0].max(axis=0)) / 2 - self._path_offset()
        return paths

    def _place_camera(self, paths: list[Array]) -> None:
        stage, placements = self._stage, self.live.moment().placements
        arm = ends(stage.capsules, placements).reshape(-1, 3)
        near = [place for place in stage.obstacles.centres if np.linalg.norm(place) < _NEAR]
        look_at_all(self.server, np.vstack([*paths, arm, *near]), stage.azimuth)

    def _show_list(self, now: Moment) -> None:
        live = self.live
        note = f"t = {now.t:.1f} of {live.ticks * live.scenario.control.period:.1f} s"
        if live.over:
            note += f", {live.fault or 'ended'}"
        playing = self.playing and not live.over
        self.list = stack_html(self.label, self._colour, now, live.controller.cell.stack.names,
                               note, () if playing else live.goals())
        self.panel.show(playing, self.list)
