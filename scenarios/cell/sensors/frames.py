"""Depth images in a folder: 16-bit PNG files, and `frames.toml` that says what they are.

`frames.toml` has width, height, fx, fy, cx, cy [px], position [m], rotation (rows; its columns are
the camera's axes in the world), scale [m] of one step of a pixel, and a table `[[frame]]` for each
image: file, time [s], and optionally q [rad or m], the robot's joints when it was taken. A pixel of
0 means no reading.

`examples/record_frames.py` writes such a folder.
"""

from __future__ import annotations

from bisect import bisect_right
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Obstacles
from hierarchy.errors import UnknownNameError
from hierarchy.problem import Array
from scenarios.cell.sensors.camera import Image, Pinhole
from scenarios.config.reading import LIBRARY
from scenarios.toml_text import read_toml

SHIPPED = LIBRARY / "frames"
ABOUT = "frames.toml"
_ROUNDING = 1e-9  # [s] of times that are compared
INTRINSICS = ("width", "height", "fx", "fy", "cx", "cy", "position", "rotation")


class RecordedFrames:
    """Depth images from a folder, or a shipped set by name, in place of a camera.

    Image i is taken at its time and available `latency` [s] later. If the folder has no joints for
    it, the robot is removed in its current state. After the last image there are no more frames.
    Raises HierarchyError, naming file and key, if the folder is invalid.
    """

    def __init__(self, folder: str | Path, robot: Robot, latency: float = 0.0) -> None:
        self.folder, self.latency = _found(folder), latency
        self.obstacles = Obstacles()
        about = read_toml(self.folder / ABOUT, "file of frames", HierarchyError)
        self.pinhole, self._scale = _pinhole(about, self.folder), about.get("scale", 1e-3)
        frames = about.get("frame") or []
        try:
            self.times = [float(frame["time"]) for frame in frames]
            files = [self.folder / frame["file"] for frame in frames]
        except (KeyError, TypeError, ValueError) as error:
            raise HierarchyError(f"{self.folder / ABOUT}: each frame needs a file and a time "
                                 f"({error!r})") from error
        if not frames or any(a >= b for a, b in zip(self.times, self.times[1:], strict=False)):
            raise HierarchyError(f"{self.folder / ABOUT}: needs frames, at increasing times")
        self._images = [_read_png(file, self.pinhole) for file in files]
        self._placements = [State.at(robot, frame["q"]).placements.copy() if "q" in frame else None
                            for frame in frames]
        self._reading = np.zeros((self.pinhole.height, self.pinhole.width), np.float32)

    def newest(self, t: float) -> int:
        """Return the number of the last image taken by time t [s], -1 before the first."""
        return bisect_right(self.times, t + _ROUNDING) - 1

    def image(self, frame: int, state: State) -> tuple[Image, Array]:
        """Return an image (h, w) [m], valid until the next, and the robot's placements then."""
        np.multiply(self._images[frame], self._scale, out=self._reading, casting="unsafe")
        placements = self._placements[frame]
        return self._reading, state.placements if placements is None else placements


def _found(folder: str | Path) -> Path:
    for place in (SHIPPED / folder, Path(folder)):
        if (place / ABOUT).is_file():
            return place
    if Path(folder).is_dir():
        raise HierarchyError(f"folder {str(folder)!r} has no {ABOUT}")
    raise UnknownNameError("folder of frames", str(folder),
                           sorted(path.name for path in SHIPPED.glob("*")))


def _pinhole(about: dict[str, Any], folder: Path) -> Pinhole:
    for key in INTRINSICS:
        if key not in about and key not in ("cx", "cy"):
            raise HierarchyError(f"{folder / ABOUT}: {key} is missing")
    return Pinhole(**{key: about[key] for key in INTRINSICS if key in about})


def _read_png(file: Path, pinhole: Pinhole) -> NDArray[np.uint16]:
    from PIL import Image as Png

    try:
        with Png.open(file) as png:
            values = np.array(png)
    except OSError as error:
        raise HierarchyError(f"{file}: {error}") from error
    if values.shape != (pinhole.height, pinhole.width) or values.dtype.kind not in "ui":
        raise HierarchyError(f"{file}: an image {values.shape} of {values.dtype}, expected "
                             f"{(pinhole.height, pinhole.width)} of integers")
    return values.astype(np.uint16)
