"""Time that plays: where it is, whether it runs, how fast; and the buttons for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass
class Playback:
    """Time t [s] between `first` and `last`, at `speed` seconds a second while it is playing."""

    first: float
    last: float
    speed: float = 1.0
    playing: bool = False

    def __post_init__(self) -> None:
        self.t = self.first

    def play(self) -> None:
        """Go on; from the begin where it is at the end."""
        if self.t >= self.last:
            self.t = self.first
        self.playing = True

    def pause(self) -> None:
        """Stay where it is."""
        self.playing = False

    def seek(self, t: float) -> None:
        """Go to the time t [s], or the nearest there is, and stay there."""
        self.t, self.playing = min(max(t, self.first), self.last), False

    def advance(self, seconds: float) -> None:
        """Let so many seconds of the clock on the wall pass; it stops at the end."""
        if not self.playing:
            return
        self.t = min(self.t + self.speed * seconds, self.last)
        self.playing = self.t < self.last


class Requests:
    """What was asked for on the page, in order, until somebody takes it.

    The page's callbacks run in threads of their own; they only put something in here.
    """

    def __init__(self) -> None:
        self._queue: SimpleQueue[tuple[str, Any]] = SimpleQueue()

    def put(self, what: str, value: Any = None) -> None:
        """Ask for something."""
        self._queue.put((what, value))

    def take(self) -> list[tuple[str, Any]]:
        """Return what was asked for since; of what was asked for more than once, the last."""
        taken: dict[str, Any] = {}
        for _ in range(self._queue.qsize()):
            what, value = self._queue.get()
            taken.pop(what, None)
            taken[what] = value
        return list(taken.items())

    def when_changed(self, handle: Any, what: str,
                     read: Callable[[Any], Any] = lambda handle: handle.value) -> None:
        """Put (what, value) whenever somebody on the page, not this program, changes an input."""
        def changed(event: Any) -> None:
            if event.client is not None:
                self.put(what, read(event.target))

        handle.on_update(changed)

    def when_pressed(self, button: Any, what: str) -> None:
        """Put (what, None) whenever a button is pressed."""
        button.on_click(lambda event: self.put(what))


class PlayButton:
    """One button that plays or pauses, and shows which."""

    def __init__(self, gui: Any, requests: Requests) -> None:
        self._handle = gui.add_button("Play", icon="player-play")
        self._playing = False
        requests.when_pressed(self._handle, "toggle")

    def show(self, playing: bool) -> None:
        """Show what a press would do."""
        if playing != self._playing:
            self._playing = playing
            self._handle.label = "Pause" if playing else "Play"
            self._handle.icon = "player-pause" if playing else "player-play"


def add_speed(gui: Any, requests: Requests, speed: float = 1.0) -> Any:
    """Add the choice of a speed; asks for ("speed", times real time)."""
    options = [f"{one:g} x" for one in sorted({*SPEEDS, speed})]
    handle = gui.add_dropdown("Speed", options, initial_value=f"{speed:g} x")
    requests.when_changed(handle, "speed", lambda one: float(one.value.split()[0]))
    return handle
