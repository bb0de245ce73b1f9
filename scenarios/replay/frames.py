"""The frames of a video: arm and surroundings, the stack, and curves under one cursor."""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from hierarchy.avoidance import Capsule, Obstacle, Obstacles
from hierarchy.avoidance.obstacles import SHAPES
from hierarchy.problem import Array
from scenarios import drawing
from scenarios.levels import Fate
from scenarios.replay.solid import Colour, Picture
from scenarios.scene import Scene, Series
from scenarios.sensors.camera import Pinhole, looking_at

Frame = NDArray[np.uint8]

SIZE = (1280, 720)  # [px], the picture in space as wide as high
_FINER = 2          # pixels drawn for each one shown
_DIRECTION = np.array([-0.65, 0.66, 0.39])  # from what is looked at to the eye
_FIELD = 0.6        # [rad]
_SKY, _INK, _QUIET, _LINE = (238, 241, 244), (26, 29, 33), (92, 101, 112), (200, 205, 211)
_LINK, _JOINT, _ALERT = (219, 224, 230), (102, 112, 128), (211, 58, 44)
_ROWS = {Fate.MET: ((207, 230, 218), "met"), Fate.FREE: ((227, 231, 236), "not acting"),
         Fate.MISSED: ((243, 201, 139), "gives up {:.3g}"),
         Fate.UNKNOWN: ((227, 231, 236), "in the stack")}
_FOOT = "foot"  # the column's name in scene.capsules
_DOT, _CELL, _CONE = 0.011, 0.25, 0.3  # [m]


class Frames:
    """Draws a scene frame by frame; `colour` "#rrggbb" is that of its path and curves."""

    def __init__(self, scene: Scene, label: str, colour: str,
                 size: tuple[int, int] = SIZE) -> None:
        self.scene, self.label, self.size = scene, label, size
        self.colour: Colour = tuple(bytes.fromhex(colour[1:]))  # type: ignore[assignment]
        self._pinhole, self._grid = _camera(scene, _FINER * size[1]), _grid(scene)
        self._links, self._plate = _standing(scene)
        self._joints = [Capsule(link.name, link.joint, link.start, link.start, 1.1 * link.radius)
                        for link in self._links if link.name != _FOOT]
        self._curves, self._cursor = _curves(scene, colour, (size[0] - size[1], size[1]))
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
        image.paste(self._beside(f), (height, 0))
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

    def _beside(self, f: int) -> Image.Image:
        """The stack as a list, and the curves with the cursor."""
        scene, image = self.scene, self._curves.copy()
        draw, bold, plain = ImageDraw.Draw(image), _font("DejaVuSans-Bold"), _font("DejaVuSans")
        draw.text((16, 10), self.label, _INK, bold)
        draw.text((image.width - 16, 10), f"{scene.t[f]:.2f} s", _INK, plain, anchor="ra")
        order = scene.orders[scene.order[f]]
        for rank, task in enumerate(order):
            n = scene.levels.names.index(task)
            colour, says = _ROWS[Fate(int(scene.levels.fate[f, n]))]
            y = 36 + 26 * rank
            draw.rounded_rectangle((14, y, image.width - 14, y + 23), 5, colour)
            draw.text((22, y + 3), f"{rank + 1}   {task}", _INK, plain)
            draw.text((image.width - 22, y + 3), says.format(scene.levels.violation[f, n]), _INK,
                      plain, anchor="ra")
        x, tops = self._cursor(scene.t[f])
        for top, bottom in tops:
            draw.line((x, top, x, bottom), _INK, 1)
        draw.text((16, _head(scene) - 22), _saturated(scene, f), _QUIET, plain)
        return image


def _saturated(scene: Scene, f: int) -> str:
    joints = [f"{j + 1}{'+' if side > 0 else '-'}"
              for j, side in enumerate(scene.levels.saturated[f]) if side]
    return f"joints at a limit: {', '.join(joints)}" if joints else ""


def _head(scene: Scene) -> int:
    """Height [px] of what is above the curves."""
    return 62 + 26 * max((len(order) for order in scene.orders), default=0)


def _camera(scene: Scene, size: int) -> Pinhole:
    """A camera that has all of the scene in its picture of size x size [px]."""
    links = scene.links.reshape(-1, 3)
    known = np.vstack([links, scene.points.reshape(-1, 3), scene.centres.reshape(-1, 3),
                       *(path.wanted for path in scene.paths if path.wanted is not None)])
    low, high = known.min(axis=0) - 0.06, known.max(axis=0) + 0.06
    middle, reach = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    eye = middle + 0.9 * reach / np.sin(_FIELD / 2) * _DIRECTION / np.linalg.norm(_DIRECTION)
    focus = size / 2 / np.tan(_FIELD / 2)
    return Pinhole(size, size, focus, focus, position=eye, rotation=looking_at(eye, middle))


def _standing(scene: Scene) -> tuple[list[Capsule], Array]:
    """The links, the column of an arm ending on the floor, and the plate (0 or 1, 16) below it."""
    links, floor = list(scene.stage.capsules), scene.stage.floor
    if not links or links[0].name != _FOOT:
        return links, np.zeros((0, 16))
    r = links[0].radius
    links[0] = replace(links[0], start=(0.0, 0.0, min(floor + r, 0.0)))
    plate = Obstacle("box", (0.0, 0.0, floor + 0.4 * r), (1.25 * r, 1.25 * r, 0.4 * r))
    return links, plate.packed()[None]


def _grid(scene: Scene) -> list[Array]:
    """Lines on the floor, cut into pieces that are hidden or not one by one."""
    links = scene.links.reshape(-1, 3)
    x, y = (np.round(links.mean(axis=0)[:2] / _CELL) * _CELL).tolist()
    along, z = np.linspace(-1.25, 1.25, 81), np.full(81, scene.stage.floor)
    steps = np.arange(-5, 6) * _CELL
    return [line for s in steps for line in (
        np.column_stack([x + along, np.full(81, y + s), z]),
        np.column_stack([np.full(81, x + s), y + along, z]))]


def _thicker(table: Array, radius: float) -> Array:
    """Obstacles grown by a radius; points stay points, boxes keep their corners."""
    grown = table.copy()
    round_ones = (table[:, 0] == SHAPES["sphere"]) | (table[:, 0] == SHAPES["capsule"])
    grown[round_ones, 1] += radius
    grown[table[:, 0] == SHAPES["box"], 1:4] += radius
    return grown


def _polyline(draw: ImageDraw.ImageDraw, picture: Picture, points: Array, colour: Any,
              width: int) -> None:
    """Draw what can be seen of a line."""
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


def _curves(scene: Scene, colour: str, size: tuple[int, int]) -> tuple[Image.Image, Any]:
    """The curves as an image, and a function of t [s] that says where the cursor is in it."""
    head, dots = _head(scene), 100.0
    with matplotlib.rc_context(drawing.style()):
        fig = Figure(figsize=(size[0] / dots, (size[1] - head) / dots), dpi=dots,
                     layout="constrained", facecolor="white")
        axes = fig.subplots(len(scene.series), 1, sharex=True, squeeze=False)[:, 0]
        for ax, series in zip(axes, scene.series, strict=True):
            _curve(ax, scene.t, series, colour)
        written = io.BytesIO()
        fig.savefig(written, format="png", dpi=dots)
    drawn = Image.open(written).convert("RGB")
    image = Image.new("RGB", size, "white")
    image.paste(drawn, (0, head))
    bottom = head + drawn.height
    spans = [(bottom - ax.bbox.y1, bottom - ax.bbox.y0) for ax in axes]
    return image, lambda t: (float(axes[0].transData.transform((t, 1.0))[0]), spans)


def _curve(ax: Any, t: Array, series: Series, colour: str) -> None:
    for c in range(series.value.shape[1]):
        one = colour if series.value.shape[1] == 1 else drawing.JOINTS[c % len(drawing.JOINTS)]
        ax.fill_between(t, series.low[:, c], series.high[:, c], color=one, linewidth=0.6)
        ax.plot(t, series.value[:, c], color=one, linewidth=0.9)
    for symbol, value in series.marks:
        ax.axhline(value, color=drawing.ALERT, linewidth=0.7, linestyle=(0, (4, 3)))
        ax.annotate(symbol, (1.0, value), xycoords=("axes fraction", "data"), ha="right",
                    va="bottom", fontsize=7)
    if series.logarithmic:
        ax.set_yscale("log", nonpositive="clip")
    ax.set_title(f"{series.name} [{series.unit}]", fontsize=8, pad=2)
    ax.tick_params(labelsize=7)
    ax.set_xlim(t[0], max(t[-1], t[0] + 1e-9))


def _font(name: str) -> Any:
    return ImageFont.truetype(str(Path(matplotlib.get_data_path()) / f"fonts/ttf/{name}.ttf"), 14)
