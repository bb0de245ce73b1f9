"""A live run on a page, where it is drawn and changed."""

import time
from contextlib import suppress
from functools import reduce
from queue import SimpleQueue
from threading import Event
from typing import Any, NamedTuple

import numpy as np

from hierarchy.errors import HierarchyError, check_name, finite_numbers, number
from hierarchy.problem import Array
from hierarchy.tasks import Position
from hierarchy.tasks.pose import Pose
from scenarios.config import Scenario
from scenarios.config.resolvers import default_resolvers
from scenarios.draw.figures.palette import looks
from scenarios.draw.replay import as_json, document, packed, run_data
from scenarios.draw.viewer.live import HAND, Live, toward
from scenarios.scene.pushes import key
from scenarios.templates import resource
from solvers import names, variants

FRAMES = 30.0   # frames per second
_BUSY = 0.05    # [s] of ticks between two frames, at most
_POINTS = 300   # of a desired path
_OFFSET = "position.offset"


class Knob(NamedTuple):
    """A number in a scenario, by its dotted key, and the range of its slider.

    level : of control, where only there the number counts.
    """

    key: str
    label: str
    high: float
    step: float
    level: str = ""


_KNOBS = (
    Knob("pointing.alpha_d", "Cone, half angle [deg]", 90.0, 0.5),
    Knob("avoidance.near", "Body, near distance [m]", 0.4, 0.005),
    Knob("avoidance.far", "Body, far distance [m]", 0.4, 0.005),
    Knob("avoidance.end_effector", "End effector, distance [m]", 0.4, 0.005),
    Knob("avoidance.distance", "Distance kept [m]", 0.3, 0.005),
    Knob("avoidance.influence", "Influence from [m]", 0.8, 0.01),
    Knob("avoidance.rate", "Approach rate [1/s]", 40.0, 0.5),
    Knob("limits.acceleration", "Joint acceleration [rad/s²]", 40.0, 0.5),
    Knob("damping.value", "Joint damping [1/s]", 20.0, 0.1),
    Knob("position.stiffness", "Path, stiffness [1/s²]", 200.0, 1.0, "acceleration"),
    Knob("position.damping", "Path, damping [1/s]", 60.0, 0.5, "acceleration"),
    Knob("pointing.stiffness", "Cone, stiffness [1/s²]", 100.0, 0.5, "acceleration"),
    Knob("pointing.damping", "Cone, damping [1/s]", 40.0, 0.5, "acceleration"),
    Knob("position.gain", "Path, gain [1/s]", 50.0, 0.5, "velocity"),
    Knob("pointing.gain", "Cone, gain [1/s]", 50.0, 0.5, "velocity"))


def knobs(scenario: Scenario) -> list[tuple[Knob, float]]:
    """Return those of the settings that a scenario has, with their values."""
    whole: Any = scenario
    return [(knob, float(value)) for knob in _KNOBS if knob.level in ("", scenario.control.level)
            and isinstance(value := reduce(lambda of, name: getattr(of, name, None),
                                           knob.key.split("."), whole), int | float)]


class LivePage:
    """A live run as a page shows it.

    `step` carries out requests, runs the ticks that are due, and makes `now`, the JSON that the
    page gets; nothing else changes the run. `answer` and `html` are for the threads of a server;
    `opened` is set once a page has asked. `refused` says why the last invalid request was rejected.
    """

    def __init__(self, live: Live, speed: float = 1.0) -> None:
        self.live, self.speed, self.playing, self.refused = live, speed, True, ""
        self.opened = Event()
        self.specs = resolvers(live.scenario)
        self._looks = looks(self.specs)
        self._requests: SimpleQueue[dict[str, Any]] = SimpleQueue()
        self._due, self._refusals, self._begun = 0.0, 0, 0
        self.live.tick()  # before it there is nothing to show
        self._follow()
        self._path_wanted = self._path_offset()
        self.now = as_json(self.data())

    def answer(self, asked: dict[str, Any]) -> str:
        """Take the requests of a page, values by what is to be changed; return `now`."""
        self.opened.set()
        if asked:
            self._requests.put(asked)
        return self.now

    def html(self) -> str:
        """Return the page."""
        scenario = self.live.scenario
        words = key(self.live.recorder.facts, scenario)
        return document(f"{scenario.title or scenario.name}, live",
                        {**self.data(), "drawn": words, "embedded": False, "beside": False},
                        "live", resource("draw/viewer/live.js"), "LivePlayer")

    @property
    def label(self) -> str:
        """The label of the present resolver."""
        return str(self.live.scenario.make_resolver().label)

    def step(self, seconds: float) -> None:
        """Carry out requests and run the ticks of so many seconds."""
        asked: dict[str, Any] = {}
        for _ in range(self._requests.qsize()):  # of repeated ones only the last counts
            asked |= self._requests.get()
        for what, value in asked.items():
            self._do(what, value)
        if self.playing and not self.live.over:
            here = self._path_offset()
            if (here != self._path_wanted).any():
                self._do(_OFFSET, toward(here, self._path_wanted,
                                         HAND * self.speed * seconds).tolist())
            self._make_ticks(seconds)
        self.now = as_json(self.data())

    def data(self) -> dict[str, Any]:
        """Return what the page shows now: a frame of the run, and the state of its controls."""
        live, scenario, playing = self.live, self.live.scenario, self.playing and not self.live.over
        run = run_data(live.frame(), scenario, self.label, self._looks[self.label],
                       fault=live.fault, events=[], **live.goals(1.0 if playing else 0.0),
                       ahead=[packed(path) for path in self._paths])
        return {"runs": [run], "playing": playing, "refused": [self._refusals, self.refused],
                "begun": self._begun, "speed": self.speed, "resolver": self.label,
                "resolvers": list(self.specs), "handles": self._handles(),
                "note": f"t = {live.t:.1f} of {scenario.control.duration:.1f} s"
                        + (", ended" if live.over else ""),
                "settings": [{**knob._asdict(), "value": value} for knob, value in knobs(scenario)]}

    def _handles(self) -> dict[str, list[float]]:
        """Return where what can be dragged is, (3,) [m] by its name."""
        obstacles = self.live.obstacles
        found = {} if obstacles is None else {
            f"obstacle {h}": place for h, place in enumerate(obstacles.centres)}
        if self.live.scenario.position is not None:
            found["path"] = self.middle + self._path_offset()
        return {name: place.tolist() for name, place in found.items()}

    def _make_ticks(self, seconds: float) -> None:
        """Run the ticks that are due as far as time allows; drop the rest."""
        live, a_second = self.live, self.speed / self.live.scenario.control.period
        self._due = min(self._due + a_second * seconds, a_second * 2.0 / FRAMES + 1.0)
        end = time.perf_counter() + _BUSY
        while self._due >= 1.0 and not live.over and time.perf_counter() < end:
            live.tick()
            self._due -= 1.0

    def _do(self, what: str, value: Any) -> None:
        try:
            if what == "toggle" and not self.live.over:
                self.playing = not self.playing
            elif what in ("toggle", "restart"):
                self.live.restart()
                self._due, self.playing, self._begun = 0.0, True, self._begun + 1
                self.live.tick()
                self._follow()
            elif what == "speed":
                self.speed = min(max(number("speed", value), 0.01), 100.0)
            elif what == "path" and self.live.scenario.position is not None:
                self._path_wanted = finite_numbers("path", value, 3) - self.middle
            elif what.startswith("obstacle ") and (obstacles := self.live.obstacles) is not None:
                h = int(what.removeprefix("obstacle "))
                kept = obstacles.centres[h] - obstacles.offset[h]
                self.live.drag(h, np.asarray(value, dtype=float) - kept)
            elif what == "resolver":
                check_name("resolver", value, self.specs)
                self.live.switch(self.specs[value])
                self._follow()
            else:
                position = [] if self.live.scenario.position is None else [_OFFSET]
                keys = [*position, *(knob.key for knob, _ in knobs(self.live.scenario))]
                check_name("setting", what, keys)
                self.live.change({what: value})
                self._follow()
        except (HierarchyError, TypeError, ValueError, IndexError, OverflowError) as error:
            self.refused, self._refusals = str(error), self._refusals + 1

    def _path_offset(self) -> Array:
        position = self.live.scenario.position
        return np.array(position.offset) if position else np.zeros(3)

    def _follow(self) -> None:
        """Note the desired paths (N, 3) [m] of the present scenario, and the middle of the first.

        That is its middle without its offset.
        """
        cell = self.live.controller.cell
        times = np.linspace(0.0, self.live.scenario.control.duration, _POINTS)
        self._paths = [np.array([task.path(t)[0] for t in times])
                       for task in (cell.tasks.position, *cell.tasks.listed)
                       if isinstance(task, Position | Pose)]
        first = self._paths[0] if self._paths else np.zeros((1, 3))
        self.middle = (first.min(axis=0) + first.max(axis=0)) / 2 - self._path_offset()


def resolvers(scenario: Scenario) -> dict[str, str]:
    """Return the specs of resolvers that can resolve a scenario, by label, its own first."""
    own = scenario.control.resolver
    found: dict[str, str] = {}
    for spec in (own, *default_resolvers(scenario.asks)[0], *names(), *variants()):
        with suppress(HierarchyError):
            other = scenario if spec == own else scenario.with_resolver(spec)
            resolver = other.make_resolver()
            if resolver.can_resolve(other.asks):
                found.setdefault(str(resolver.label), spec)
    return found
