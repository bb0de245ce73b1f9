"""The frames of a video: arm and surroundings, the stack, and curves with a cursor."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from hierarchy.avoidance import Capsule, Obstacle, Obstacles
from hierarchy.avoidance.obstacles import SHAPES
from hierarchy.problem import Array
from scenarios.cell.sensors.camera import Pinhole, looking_at
from scenarios.draw.replay.beside import Beside
from scenarios.draw.replay.solid import Colour, Picture
from scenarios.scene import Scene

Frame = NDArray[np.uint8]

SIZE = (1280, 720)  # [px], the 3D picture being square
_FINER = 2          # pixels drawn per pixel shown, in each direction
_ELEVATION = 0.4    # [rad] of the camera
_FIELD = 0.6        # [rad]
_SKY, _INK, _QUIET, _LINE = (238, 241, 244), (26, 29, 33), (92, 101, 112), (200, 205, 211)
_LINK, _JOINT, _ALERT = (219, 224, 230), (102, 112, 128), (211, 58, 44)
_FOOT = "foot"  # the column's name in scene.capsules
_DOT, _CELL, _CONE = 0.011, 0.25, 0.3  # [m]


class Frames:
    """Draws a scene frame by frame; `colour` "#rrggbb" is used for its path and curves."""

    def __init__(self, scene: Scene, label: str, colour: str,
                 size: tuple[int, int] = SIZE) -> None:
        self.scene, self.size = scene, size
        self.colour: Colour = tuple(bytes.fromhex(colour[1:]))  # type: ignore[assignment]
        self._pinhole, self._grid = _camera(scene, _FINER * size[1]), _grid(scene)
        self._links, self._plate = _standing(scene)
        self._joints = [Capsule(link.name, link.joint, link.start, link.start, 1.1 * link.radius)
                        for link in self._links if link.name != _FOOT]
        self._beside = Beside(scene, label, colour, (size[0] - size[1], size[1]))
        self._obstacles = Obstacles(scene.stage.obstacles.obstacles)

    def __len__(self) -> int:
        return len(self.scene.t)

    def __iter__(self) -> Iterator[Frame]:
        return (self.draw(f) for f in range(len(self)))

    def draw(self, f: int) -> Frame:
        """Return frame f as (height, width, 3) bytes."""
        height = self.size[1]
        image = Image.new("RGB", self.size, "white")
        image.paste(self._space(f).resize((height, height), Image.Resampling.BOX), (0, 0))
        image.paste(self._beside.draw(f), (height, 0))
        return np.asarray(image)

    def _space(self, f: int) -> Image.Image:
        scene, picture = self.scene, Picture(self._pinhole, _SKY)
        table = self._obstacles.at(scene.t[f])
        table[:, 4:7] = scene.centres[f]
        picture.draw_links(self._links, scene.placements[f], _LINK)
        picture.draw_links(self._joints, scene.placements[f], _JOINT)
        picture.draw_obstacles(self._plate, 0.0, _JOINT)
        picture.draw_obstacles(table, 1.3 * _DOT, _ALERT)
        for _, radius in scene.stage.areas:
            picture.tint(_thicker(table, radius), radius, _ALERT, 0.13)
        image = Image.fromarray(picture.image)
        self._lines(f, picture, ImageDraw.Draw(image, "RGBA"))
        return image

    def _lines(self, f: int, picture: Picture, draw: ImageDraw.ImageDraw) -> None:
        scene, tip = self.scene, self.scene.traced[f]
        for line in self._grid:
            _polyline(draw, picture, line, (*_LINE, 255), 1)
        wanted = [scene.desired, *(path.wanted for path in scene.paths)]
        for line in (path for path in wanted if path is not None):
            _polyline(draw, picture, line, (*_INK, 120), 1)
        for line in (scene.traced, *(path.actual for path in scene.paths)):
            _polyline(draw, picture, line, (*self.colour, 70), 2)
            _polyline(draw, picture, line[:f + 1], (*self.colour, 255), 3)
        if scene.stage.axis is not None:
            self._cone(draw, tip, scene.stage.axis, scene.stage.half_angle)
        _line(draw, self._pinhole, np.array([tip, tip + _CONE * scene.axis[f]]), self.colour, 3)
        k, active = int(scene.linked[f]), scene.active[f] >= 0
        if np.isfinite(scene.distance[f, k]):
            link = np.array([scene.points[f, k], scene.nearest[f, k]])
            _line(draw, self._pinhole, link, _ALERT if active else _QUIET, 3 if active else 1)
        for i, point in enumerate(scene.points[f]):
            radius = 0.75 * _DOT * (1.6 if i == scene.active[f] else 1.0)
            fill = _ALERT if i == scene.active[f] else _INK
            _dot(draw, self._pinhole, point, radius, fill)

    def _cone(self, draw: ImageDraw.ImageDraw, tip: Array, axis: Array, angle: float) -> None:
        side = np.cross(axis, [0.0, 0.0, 1.0] if abs(axis[2]) < 0.9 else [1.0, 0.0, 0.0])
        side /= np.linalg.norm(side)
        turns = np.linspace(0.0, 2 * np.pi, 25)[:, None]
        ring = tip + _CONE * (np.cos(angle) * axis + np.sin(angle) * (
            np.cos(turns) * side + np.sin(turns) * np.cross(axis, side)))
        apex, rim = self._pinhole.project(tip), self._pinhole.project(ring)
        for a, b in itertools.pairwise(rim):
            draw.polygon([tuple(p[:2]) for p in (apex, a, b)], fill=(*self.colour, 60))


def _camera(scene: Scene, size: int) -> Pinhole:
    """Return a camera with the whole scene in its image of size x size [px]."""
    links = scene.links.reshape(-1, 3)
    known = np.vstack([links, scene.points.reshape(-1, 3), scene.centres.reshape(-1, 3),
                       *(path.wanted for path in scene.paths if path.wanted is not None)])
    low, high = known.min(axis=0) - 0.06, known.max(axis=0) + 0.06
    middle, reach = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    a, e = scene.stage.azimuth, _ELEVATION
    away = np.array([np.cos(a) * np.cos(e), np.sin(a) * np.cos(e), np.sin(e)])
    eye = middle + 0.9 * reach / np.sin(_FIELD / 2) * away
    focus = size / 2 / np.tan(_FIELD / 2)
    return Pinhole(size, size, focus, focus, position=eye, rotation=looking_at(eye, middle))


def _standing(scene: Scene) -> tuple[list[Capsule], Array]:
    """Return the links, any column ending on the floor, and the plate (0 or 1, 16) below it."""
    links, floor = list(scene.stage.capsules), scene.stage.floor
    if not links or links[0].name != _FOOT:
        return links, np.zeros((0, 16))
    r = links[0].radius
    links[0] = replace(links[0], start=(0.0, 0.0, min(floor + r, 0.0)))
    plate = Obstacle("box", (0.0, 0.0, floor + 0.4 * r), (1.25 * r, 1.25 * r, 0.4 * r))
    return links, plate.packed()[None]


def _grid(scene: Scene) -> list[Array]:
    """Return lines on the floor, cut into pieces whose visibility is tested one by one."""
    links = scene.links.reshape(-1, 3)
    x, y = (np.round(links.mean(axis=0)[:2] / _CELL) * _CELL).tolist()
    along, z = np.linspace(-1.25, 1.25, 81), np.full(81, scene.stage.floor)
    steps = np.arange(-5, 6) * _CELL
    return [line for s in steps for line in (
        np.column_stack([x + along, np.full(81, y + s), z]),
        np.column_stack([np.full(81, x + s), y + along, z]))]


def _thicker(table: Array, radius: float) -> Array:
    """Return obstacles grown by a radius; points stay points, boxes keep sharp corners."""
    grown = table.copy()
    round_ones = (table[:, 0] == SHAPES["sphere"]) | (table[:, 0] == SHAPES["capsule"])
    grown[round_ones, 1] += radius
    grown[table[:, 0] == SHAPES["box"], 1:4] += radius
    return grown


def _polyline(draw: ImageDraw.ImageDraw, picture: Picture, points: Array, colour: Any,
              width: int) -> None:
    """Draw the visible part of a line."""
    if len(points) < 2:
        return
    seen = picture.is_seen((points[1:] + points[:-1]) / 2)
    at = picture.pinhole.project(points)[:, :2]
    for k in np.flatnonzero(seen):
        draw.line((*at[k], *at[k + 1]), colour, _FINER * width)


def _line(draw: ImageDraw.ImageDraw, pinhole: Pinhole, points: Array, colour: Any,
          width: int) -> None:
    draw.line(pinhole.project(points)[:, :2].ravel().tolist(), colour, _FINER * width)


def _dot(draw: ImageDraw.ImageDraw, pinhole: Pinhole, point: Array, radius: float,
         colour: Colour) -> None:
    u, v, depth = pinhole.project(point)
    r = pinhole.fx * radius / depth
    draw.ellipse((u - r, v - r, u + r, v + r), colour)
