"""Playback time, its speed, and the buttons for it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass
class Playback:
    """Time t [s] between `first` and `last`, with real-time factor `speed` while it is playing."""

    first: float
    last: float
    speed: float = 1.0
    playing: bool = False

    def __post_init__(self) -> None:
        self.t = self.first

    def play(self) -> None:
        """Play; at the end, start again."""
        if self.t >= self.last:
            self.t = self.first
        self.playing = True

    def pause(self) -> None:
        """Pause."""
        self.playing = False

    def seek(self, t: float) -> None:
        """Go to time t [s], clipped to the range, and pause."""
        self.t, self.playing = min(max(t, self.first), self.last), False

    def advance(self, seconds: float) -> None:
        """Advance by so many seconds of wall-clock time; stop at the end."""
        if not self.playing:
            return
        self.t = min(self.t + self.speed * seconds, self.last)
        self.playing = self.t < self.last


class Requests:
    """A queue of the page's requests.

    The page's callbacks run in threads of their own; they only put requests into it.
    """

    def __init__(self) -> None:
        self._queue: SimpleQueue[tuple[str, Any]] = SimpleQueue()

    def put(self, what: str, value: Any = None) -> None:
        """Add a request."""
        self._queue.put((what, value))

    def take(self) -> list[tuple[str, Any]]:
        """Return the requests since the last call, in order; of repeated ones only the last."""
        taken: dict[str, Any] = {}
        for _ in range(self._queue.qsize()):
            what, value = self._queue.get()
            taken.pop(what, None)
            taken[what] = value
        return list(taken.items())

    def when_changed(self, handle: Any, what: str,
                     read: Callable[[Any], Any] = lambda handle: handle.value) -> None:
        """Add (what, value) whenever a user of the page changes an input."""
        def changed(event: Any) -> None:
            if event.client is not None:
                self.put(what, read(event.target))

        handle.on_update(changed)

    def when_pressed(self, button: Any, what: str) -> None:
        """Add (what, None) whenever a button is pressed."""
        button.on_click(lambda event: self.put(what))


class PlayButton:
    """One button that plays or pauses."""

    def __init__(self, gui: Any, requests: Requests) -> None:
        self._handle = gui.add_button("Play", icon="player-play")
        self._playing = False
        requests.when_pressed(self._handle, "toggle")

    def show(self, playing: bool) -> None:
        """Show the action of the next press."""
        if playing != self._playing:
            self._playing = playing
            self._handle.label = "Pause" if playing else "Play"
            self._handle.icon = "player-pause" if playing else "player-play"


def add_speed(gui: Any, requests: Requests, speed: float = 1.0) -> Any:
    """Add the choice of a real-time factor; requests ("speed", factor)."""
    options = [f"{one:g} x" for one in sorted({*SPEEDS, speed})]
    handle = gui.add_dropdown("Speed", options, initial_value=f"{speed:g} x")
    requests.when_changed(handle, "speed", lambda one: float(one.value.split()[0]))
    return handle
