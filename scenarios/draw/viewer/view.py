"""Finished runs in the browser under one time cursor, side by side or overlaid."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hierarchy.problem import Array
from scenarios.draw.figures.drawing import colours
from scenarios.draw.figures.picture import once
from scenarios.draw.viewer.model import Model
from scenarios.draw.viewer.moment import of_scene
from scenarios.draw.viewer.playback import Playback, PlayButton, Requests, add_speed
from scenarios.draw.viewer.plots import Plots
from scenarios.draw.viewer.server import add_dark, lay_floor, lay_out, look_at_all, right
from scenarios.draw.viewer.stack_list import key_html, stack_html
from scenarios.measure.verdict import verdict
from scenarios.recording.recording import Recording
from scenarios.scene import Scene, scene
from scenarios.scene.pushes import key

FRAMES = 30.0  # per second
_CURSORS = 8.0  # moves of the plots' cursor per second during playback
_SEE_THROUGH = 0.35
_APART = 1.15   # distance between runs, relative to a run's width
_POSES = 50     # of the arm that the camera has in view
_ABOVE = 0.08   # [m] height of a run's label above it
_BESIDE, _OVERLAID = "side by side", "overlaid"


class View:
    """Runs, by label, drawn into a server; `step` carries out requests and lets time pass.

    Public for tests: `playback`, `lists` (the stacks' HTML by label).
    """

    def __init__(self, server: Any, runs: dict[str, Recording], side_by_side: bool = True) -> None:
        self.server, self.requests = server, Requests()
        self.scenes = {label: scene(recording, FRAMES) for label, recording in runs.items()}
        self.colours = colours(runs)
        self._goals = {label: verdict(recording).said for label, recording in runs.items()}
        self.lists: dict[str, str] = {}
        self.playback = Playback(float(min(one.t[0] for one in self.scenes.values())),
                                 float(max(one.t[-1] for one in self.scenes.values())))
        lay_floor(server, min(one.stage.floor for one in self.scenes.values()))
        self.models = {label: Model(server, f"/run{i}", one.stage, self.colours[label],
                                    _paths(one))
                       for i, (label, one) in enumerate(self.scenes.items())}
        self._names = self._name_runs()
        self._shown: dict[str, int] = {}
        self._cursor, self._cursor_at = np.nan, -np.inf
        self._panel(side_by_side, [one.scenario.title or one.scenario.name
                                   for one in runs.values()])
        for label, one in runs.items():
            if words := key(one.facts, one.scenario):
                server.gui.add_html(key_html(words, self.colours[label]))
                break
        self._arrange(side_by_side)
        self.draw()

    def serve(self) -> None:
        """Play until Ctrl-C."""
        last = time.monotonic()
        while True:
            time.sleep(1.0 / FRAMES)
            now = time.monotonic()
            self.step(now - last)
            last = now

    def step(self, seconds: float) -> None:
        """Carry out requests, let so many seconds pass, and draw."""
        for what, value in self.requests.take():
            self._do(what, value)
        self.playback.advance(seconds)
        self.draw()

    def draw(self) -> None:
        """Show all runs at the time of the playback."""
        t = self.playback.t
        with self.server.atomic():
            for label, one in self.scenes.items():
                f = _frame_at(one, t)
                if self._shown.get(label) != f:
                    self._shown[label] = f
                    self._draw_run(label, one, f)
        self._slider.value = t
        self._button.show(self.playback.playing)
        self._move_cursor(t)

    def _draw_run(self, label: str, one: Scene, f: int) -> None:
        now = of_scene(one, f)
        traces = [path.actual[:f + 1] for path in one.paths] or [one.traced[:f + 1]]
        self.models[label].show(now, traces)
        note = "ended" if self.playback.t > one.t[-1] else ""
        html = stack_html(label, self.colours[label], now, one.levels.names, note,
                          self._goals[label])
        if html != self.lists.get(label):
            self.lists[label] = self._stacks[label].content = html

    def _move_cursor(self, t: float) -> None:
        """Move the plots' cursor; plots are slow in the browser, so they follow less often."""
        due = time.monotonic() - self._cursor_at > 1.0 / _CURSORS
        if t != self._cursor and (due or not self.playback.playing):
            self._cursor, self._cursor_at = t, time.monotonic()
            self._plots.show(t)

    def _do(self, what: str, value: Any) -> None:
        playback = self.playback
        if what == "toggle":
            (playback.pause if playback.playing else playback.play)()
        elif what == "seek":
            playback.seek(value)
        elif what == "speed":
            playback.speed = value
        elif what == "layout":
            self._arrange(value == _BESIDE)

    def _panel(self, side_by_side: bool, titles: Sequence[str]) -> None:
        gui, playback = self.server.gui, self.playback
        with lay_out(self.server):
            self._plots = Plots(gui, {label: (one.t, one.series)
                                      for label, one in self.scenes.items()}, self.colours)
        for title in dict.fromkeys(titles):
            gui.add_markdown(f"**{title}**")
        self._button = PlayButton(gui, self.requests)
        self._slider = gui.add_slider("Time [s]", playback.first, playback.last, 0.001,
                                      playback.first)
        self.requests.when_changed(self._slider, "seek")
        add_speed(gui, self.requests)
        if len(self.scenes) > 1:
            layout = gui.add_dropdown("Runs", [_BESIDE, _OVERLAID],
                                      initial_value=_BESIDE if side_by_side else _OVERLAID)
            self.requests.when_changed(layout, "layout")
        add_dark(self.server, min(one.stage.floor for one in self.scenes.values()))
        self._stacks = {label: gui.add_html("") for label in self.scenes}

    def _name_runs(self) -> list[Any]:
        """Add labels above the runs, visible if there are several."""
        names = []
        for i, (label, one) in enumerate(self.scenes.items()):
            points = _points(one)
            above = (*points.mean(axis=0)[:2], points[:, 2].max() + _ABOVE)
            names.append(self.server.scene.add_label(f"/run{i}/label", label, position=above,
                                                     anchor="bottom-center"))
        return names

    def _arrange(self, side_by_side: bool) -> None:
        """Place the runs side by side, or in one place with all but the first transparent."""
        azimuth = next(iter(self.scenes.values())).stage.azimuth
        points = [_points(one) for one in self.scenes.values()]
        across = np.vstack(points) @ right(azimuth)
        apart = right(azimuth) * (_APART * np.ptp(across)) * side_by_side
        for i, model in enumerate(self.models.values()):
            model.place(apart * i)
            model.fade(_SEE_THROUGH if i and not side_by_side else None)
        for name in self._names:
            name.visible = side_by_side and len(self._names) > 1
        look_at_all(self.server, np.vstack([seen + apart * i for i, seen in enumerate(points)]),
                    azimuth)


def labelled(folders: Sequence[Path], recordings: Sequence[Recording]) -> dict[str, Recording]:
    """Return recordings by their resolvers' labels; equal labels get the folder as well."""
    labels = [one.facts.resolver.label for one in recordings]
    if len({one.scenario.name for one in recordings}) > 1:
        labels = [f"{label} {one.scenario.name}"
                  for label, one in zip(labels, recordings, strict=True)]
    return {label if labels.count(label) == 1 else f"{label} in {folder}": one
            for label, folder, one in zip(labels, folders, recordings, strict=True)}


def _frame_at(one: Scene, t: float) -> int:
    """Return the last frame that is not after time t [s]."""
    return max(int(np.searchsorted(one.t, t + 1e-9, side="right")) - 1, 0)


def _points(one: Scene) -> Array:
    """Return points (N, 3) [m] of arm and path, and of the obstacles at the start."""
    links = one.links[:: max(len(one.t) // _POSES, 1)].reshape(-1, 3)
    return np.vstack([links, one.traced, one.centres[0] if one.centres.size else links[:0]])


def _paths(one: Scene) -> list[Array]:
    """Return the desired paths of points, (N, 3) [m] each."""
    wanted = [one.desired, *(path.wanted for path in one.paths)]
    return [once(path) for path in wanted if path is not None]
