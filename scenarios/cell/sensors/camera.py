"""Sources of depth images: a simulated camera with errors of its readings, and recorded images."""

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from math import floor, inf
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy import HierarchyError, Robot, State
from hierarchy.avoidance import Capsule, Obstacles
from hierarchy.avoidance.body import pack_capsules
from hierarchy.errors import UnknownNameError, naming
from hierarchy.gate import check_rotation
from hierarchy.jit import compiled, internal
from hierarchy.problem import Array
from hierarchy.records import set_frozen
from scenarios.cell.sensors.rendering import draw_scene
from scenarios.config.files import LIBRARY
from scenarios.config.sections.sensor import CameraSection, FramesFile
from scenarios.config.validation import validated
from scenarios.toml_text import read_toml

Image = NDArray[np.float32]
_WIDEST = 3.5      # [standard deviations] at which noise is clipped, so that it is bounded
_EDGE = 0.05       # [m] depth difference between two pixels at an edge
_UPRIGHT = 1e-6    # from 1, of a direction's vertical part: the image then has another x axis
_ROUNDING = 1e-9   # [s] of times that are compared
SHIPPED = LIBRARY / "frames"
ABOUT = "frames.toml"
INTRINSICS = ("width", "height", "fx", "fy", "cx", "cy", "position", "rotation")


@dataclass(frozen=True)
class Pinhole:
    """Intrinsics and pose of a camera.

    width, height [px]; fx, fy [px]; cx, cy [px], the middle of the image if None. A pixel u, v has
    its centre there. position (3,) [m]; rotation (3, 3), whose columns are the camera's axes in
    the world: x to the right of the image, y down, z along the optical axis.
    """

    width: int = 640
    height: int = 480
    fx: float = 525.0
    fy: float = 525.0
    cx: float | None = None
    cy: float | None = None
    position: ArrayLike = (0.0, 0.0, 0.0)
    rotation: ArrayLike = ((1, 0, 0), (0, 1, 0), (0, 0, 1))

    def __post_init__(self) -> None:
        for name, size in (("cx", self.width), ("cy", self.height)):
            if getattr(self, name) is None:
                set_frozen(self, **{name: (size - 1) / 2})
        check_rotation("camera: rotation", self.rotation)

    def packed(self) -> Array:
        """Return the array (16,) for kernels: fx, fy, cx, cy, position, rotation row by row."""
        return np.array([self.fx, self.fy, self.cx, self.cy,
                         *np.asarray(self.position, dtype=float),
                         *np.asarray(self.rotation, dtype=float).ravel()])

    def project(self, points: ArrayLike) -> Array:
        """Return u, v [px] and depth [m] (..., 3) of world points (..., 3) [m]."""
        seen = (np.asarray(points, dtype=float) - np.asarray(self.position)) @ np.asarray(
            self.rotation, dtype=float)
        depth = seen[..., 2]
        return np.stack([self.fx * seen[..., 0] / depth + self.cx,
                         self.fy * seen[..., 1] / depth + self.cy, depth], axis=-1)


def looking_at(position: ArrayLike, target: ArrayLike) -> Array:
    """Return the rotation (3, 3) of an upright camera at `position` [m] that faces `target` [m].

    The world's z axis points up in the image, or its y axis if the camera looks straight up or
    down.
    """
    forward = np.subtract(target, position).astype(float)
    length = float(np.linalg.norm(forward))
    if length == 0.0:
        raise HierarchyError(f"camera: position and look_at are both {np.ravel(target).tolist()} m")
    forward /= length
    upright = np.abs(forward[2]) < 1.0 - _UPRIGHT
    right = np.cross(forward, (0.0, 0.0, 1.0) if upright else (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(forward, right), forward])


class DepthCamera:
    """Takes depth images (h, w) [m] of obstacles and a robot of capsules; 0 means no reading.

    Frame i is taken at i / rate plus up to jitter. Its errors depend only on seed and i. `scene`
    has the true depths of the last frame, infinite where there is nothing. `joints` returns the
    true q (nq,) of the robot, None where it is what is measured.
    """

    joints: Callable[[], Array] | None = None

    def __init__(self, section: CameraSection, pinhole: Pinhole, obstacles: Obstacles,
                 capsules: tuple[Capsule, ...]) -> None:
        if not section.jitter < 1.0 / section.rate:
            raise HierarchyError(f"camera: jitter = {section.jitter} s must be below 1 / rate = "
                                 f"{1.0 / section.rate:.3g} s")
        self.pinhole, self.obstacles, self.latency = pinhole, obstacles, section.latency
        self._section, self._backdrop = section, section.backdrop or inf
        self._eye, self._packed = pinhole.packed(), section.packed()
        self._links, self._capsules = pack_capsules(capsules)
        size = (pinhole.height, pinhole.width)
        self.scene, self._reading = np.zeros(size, np.float32), np.zeros(size, np.float32)
        self._normal, self._uniform = np.zeros(size, np.float32), np.ones(size, np.float32)

    def time(self, frame: int) -> float:
        """Return the time at which a frame is taken [s]."""
        jitter = self._section.jitter
        wait = jitter * self._rng(frame, 1).random() if jitter else 0.0
        return frame / self._section.rate + wait

    def newest(self, t: float) -> int:
        """Return the number of the last frame taken by time t [s], -1 before the first."""
        frame = floor((t + _ROUNDING) * self._section.rate)
        return frame - (frame >= 0 and self.time(frame) > t + _ROUNDING)

    def image(self, frame: int, state: State) -> tuple[Image, Array]:
        """Return an image taken at a state, valid until the next, and the placements measured."""
        if self.joints is not None:
            state.beside.move(state.t, self.joints(), state.v)
        seen = state if self.joints is None else state.beside
        draw_scene(self.scene, self._eye, self._backdrop, self.obstacles.at(state.t),
                   self._section.point_radius, seen.placements, self._links, self._capsules)
        rng = self._rng(frame, 0)
        if self._section.random:
            rng.standard_normal(out=self._normal, dtype=np.float32)
            rng.random(out=self._uniform, dtype=np.float32)
        expose(self.scene, self._normal, self._uniform, self._packed, self._reading)
        self._section.add_outliers(rng, self._reading)
        return self._reading, state.placements

    def _rng(self, frame: int, use: int) -> np.random.Generator:
        return np.random.default_rng((self._section.seed, frame, use))


class RecordedFrames:
    """Depth images from a folder, or a shipped set by name, in place of a camera.

    The folder has 16-bit PNG files, in which 0 means no reading, and `frames.toml` with the keys of
    a `FramesFile`. `examples/record_frames.py` writes it.

    Image i is taken at its time and available `latency` [s] later. If the folder has no joints for
    it, the robot is removed in its current state. After the last image there are no more frames.
    Raises HierarchyError, naming file and key, if the folder is invalid.
    """

    def __init__(self, folder: str | Path, robot: Robot, latency: float = 0.0) -> None:
        self.folder, self.latency = _found(folder), latency
        self.obstacles = Obstacles()
        file = self.folder / ABOUT
        about = validated(FramesFile, read_toml(file, "file of frames", HierarchyError), str(file))
        with naming(str(file)):
            self.pinhole = Pinhole(**{key: getattr(about, key) for key in INTRINSICS})
        self._scale, self.times = about.scale, [frame.time for frame in about.frame]
        self._images = [_read_png(self.folder / one.file, self.pinhole) for one in about.frame]
        self._placements: list[Array | None] = []
        for i, one in enumerate(about.frame):
            with naming(f"{file}: frame.{i}.q"):
                self._placements.append(
                    None if one.q is None else State.at(robot, one.q).placements.copy())
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


def _read_png(file: Path, pinhole: Pinhole) -> NDArray[np.uint16]:
    from PIL import Image as Png

    with naming(str(file), of=OSError), Png.open(file) as png:
        values = np.array(png)
    if values.shape != (pinhole.height, pinhole.width) or values.dtype.kind not in "ui":
        raise HierarchyError(f"{file}: an image {values.shape} of {values.dtype}, expected "
                             f"{(pinhole.height, pinhole.width)} of integers")
    return values.astype(np.uint16)


@compiled
def expose(depth, normal, uniform, errors, reading):
    """Make a reading (h, w) out of true depths (h, w) and random numbers (h, w) for each pixel.

    A reading of 0 is none.
    """
    height, width = depth.shape
    floor, growth, start = errors[0], errors[1], errors[2]
    step, near, far = errors[4], errors[5], errors[6]
    for v in range(height):
        for u in range(width):
            z = float(depth[v, u])
            reading[v, u] = 0.0
            if not (near <= z <= far and z < np.inf):
                continue
            share = errors[8] if errors[8] > errors[7] and _at_edge(depth, v, u) else errors[7]
            if uniform[v, u] < share:
                continue
            chance = min(max(normal[v, u], -_WIDEST), _WIDEST)
            z += chance * (floor + growth * (z - start) * (z - start))
            if step > 0.0 and errors[3] > 0.0:
                z = 1.0 / (step * np.rint(1.0 / (step * z)))
            elif step > 0.0:
                z = step * np.rint(z / step)
            if near <= z <= far:
                reading[v, u] = z


@internal
def _at_edge(depth, v, u):
    z = depth[v, u]
    return ((v > 0 and abs(depth[v - 1, u] - z) > _EDGE)
            or (v + 1 < depth.shape[0] and abs(depth[v + 1, u] - z) > _EDGE)
            or (u > 0 and abs(depth[v, u - 1] - z) > _EDGE)
            or (u + 1 < depth.shape[1] and abs(depth[v, u + 1] - z) > _EDGE))
