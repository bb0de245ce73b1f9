"""Handles that are dragged on the page: obstacles and the path of the target."""

from __future__ import annotations

from typing import Any

import numpy as np

from hierarchy.problem import Array
from scenarios.draw.viewer.playback import Requests

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
