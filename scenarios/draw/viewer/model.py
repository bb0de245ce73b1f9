"""One run in space: nodes that are created once and then moved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from scenarios.draw.figures.drawing import ALERT, INK
from scenarios.draw.viewer.meshes import Mesh, cone_mesh, hull_of_balls, obstacle_mesh
from scenarios.draw.viewer.moment import Moment
from scenarios.scene import Stage, ends, place

Rgb = tuple[int, int, int]
Segments = NDArray[np.float32]  # (M, 2, 3) [m]

_SLIM = 0.62            # of the capsules' radii, so that points and paths on the arm are visible
_TIP = 0.012            # [m] radius at the end effector
_DOT = 0.012            # [m] radius of a control point
_AXIS = 0.3             # [m] length of the cone
_BAND = 0.002           # [m] by which control points protrude from the links
_ON_AXIS = 0.3          # of a link's radius: points this near to its axis are on it
_AXIS_WIDTH = 0.003     # [m]
_AREA_OPACITIES = (0.20, 0.08)  # of the inner and the outer area
_PATH_VERTICES = 400
_PALE, _DARK, _AMBER, _GREEN = (214, 219, 226), (60, 66, 74), (214, 138, 0), (0, 158, 115)
PUSHES = {"force": (ALERT, 4.0), "cone": (INK, 1.0), "support": ("", 3.0), "centre": (INK, 3.0),
          "push": ("#0b62b8", 5.0),
          "table": ("#8a929c", 1.5)}  # colour, "" for that of the run, and width [px]


def rgb(colour: str) -> Rgb:
    """Return a colour #rrggbb as three numbers up to 255."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


class Model:
    """A run drawn into a viser server under `name`, in the colour of its resolver.

    `place` moves it, `fade` makes it transparent, `show` brings it to a moment.
    """

    def __init__(self, server: Any, name: str, stage: Stage, colour: str,
                 paths: Sequence[Array] = ()) -> None:
        self._scene, self._name, self._stage = server.scene, name, stage
        self._colour = rgb(colour)
        self._root = self._frame("")
        self._joints = [self._frame(f"/joint{j}")
                        for j in range(len(stage.robot.joints) + 1)]
        self._solid = [*self._links(), *self._control_points()]
        self._obstacles = [self._frame(f"/obstacle{h}") for h in range(len(stage.obstacles))]
        self._draw_obstacles()
        self._areas: list[Any] = []
        self._cone: Any = None
        self.set_stage(stage)
        self._painted = [node for node in self._solid if tuple(node.color) == self._colour]
        if stage.axis is not None:
            self._painted.append(self._pointer())
        self._active = self._ball("/active", 1.7 * _DOT, rgb(ALERT))
        self._link = self._lines("/link", _segments(()), rgb(ALERT), 3.0)
        self._paths: list[Any] = []
        self._traces: list[Any] = []
        self._goals: list[Any] = []
        self._pushes = [self._lines(f"/contacts/{name}", _segments(()), rgb(shade or colour), width)
                        for name, (shade, width) in PUSHES.items()]
        self.set_paths(paths)

    def set_stage(self, stage: Stage) -> None:
        """Draw the areas and the cone of another stage."""
        self._stage = stage
        for area in self._areas:
            area.remove()
        self._areas = [self._area(h, i, radius) for h in range(len(self._obstacles))
                       for i, (_, radius) in enumerate(stage.areas) if radius > 0.0]
        if self._cone is not None:
            self._cone.remove()
        self._cone = None if stage.axis is None else self._add_mesh(
            "/cone", cone_mesh(stage.half_angle, _AXIS), _GREEN, opacity=0.3, side="double",
            wxyz=_turn_z_to(stage.axis), cast_shadow=False)

    def place(self, offset: Array) -> None:
        """Move everything by an offset (3,) [m]."""
        self._root.position = offset

    def fade(self, opacity: float | None) -> None:
        """Make the arm transparent and hide areas; None for an opaque arm with areas."""
        for node in self._solid:
            node.opacity = opacity
        for area in self._areas:
            area.visible = opacity is None

    def paint(self, colour: str) -> None:
        """Give the arm the colour of another resolver."""
        if rgb(colour) != self._colour:
            self._colour = rgb(colour)
            for node in self._painted:
                node.color = self._colour

    def set_paths(self, paths: Sequence[Array]) -> None:
        """Draw the desired paths, (N, 3) [m] each; their number must not change."""
        for i, path in enumerate(paths):
            if i == len(self._paths):
                self._paths.append(self._lines(f"/path{i}", _segments(()), rgb(INK), 1.5))
            self._paths[i].points = _segments(path)

    def show(self, now: Moment, traces: Sequence[Array],
             colours: NDArray[Any] | None = None) -> None:
        """Show a moment, with traces (N, 3) [m] of points.

        `colours` (N, 3) of the traces are from 0 to 255; None takes the colour of the run.
        """
        for frame, row in zip(self._joints, now.placements, strict=True):
            frame.wxyz, frame.position = _quaternion(row[:9].reshape(3, 3).T), row[9:]
        for frame, centre in zip(self._obstacles, now.centres, strict=True):
            frame.position = centre
        self._show_traces(traces, colours)
        for i, goal in enumerate(now.goals):
            if i == len(self._goals):
                self._goals.append(self._ball(f"/goal{i}", 1.3 * _DOT, rgb(INK)))
            self._goals[i].position = goal
        self._show_nearest(now)
        for lines, segments in zip(self._pushes, now.pushes or (), strict=False):
            lines.points = segments.astype(np.float32) if len(segments) else _segments(())
        if self._stage.axis is not None:
            self._show_cone(now, self._stage.axis)

    def _show_traces(self, traces: Sequence[Array], colours: NDArray[Any] | None) -> None:
        for i, trace in enumerate(traces):
            if i == len(self._traces):
                self._traces.append(self._lines(f"/trace{i}", _segments(()), self._colour, 4.0))
            self._traces[i].points = _segments(trace)
            if colours is not None and len(trace) > 1:
                kept = _linear(colours[_thinned(len(colours))])
                self._traces[i].colors = np.stack([kept[:-1], kept[1:]], axis=1)

    def _show_nearest(self, now: Moment) -> None:
        self._active.visible = now.active >= 0
        self._active.position = now.points[now.linked]
        self._link.visible = now.nearest is not None
        if now.nearest is not None:
            self._link.points = np.array([[now.points[now.linked], now.nearest]], np.float32)
            self._link.colors = np.array(rgb(ALERT) if now.active >= 0 else (150, 150, 150),
                                         np.uint8)

    def _show_cone(self, now: Moment, axis: Array) -> None:
        self._cone.position = now.points[-1]
        outside = float(now.axis @ axis) < np.cos(self._stage.half_angle)
        colour = _AMBER if outside else _GREEN
        if tuple(self._cone.color) != colour:
            self._cone.color = colour

    def _links(self) -> list[Any]:
        """Draw the arm: pale links, joints in the run's colour, a tapered tool."""
        drawn: list[Any] = []
        tool = self._stage.points[-1]
        for i, capsule in enumerate(self._stage.capsules):
            radius = _SLIM * capsule.radius
            last = capsule.joint == tool.joint and np.allclose(capsule.end, tool.offset)
            ends = (capsule.start, capsule.end)
            hull = hull_of_balls(ends, (radius, _TIP if last else radius))
            drawn.append(self._add_mesh(f"/joint{capsule.joint}/link{i}", hull, _PALE))
            for k, end in enumerate(ends[:1] if last else ends):
                drawn.append(self._ball(f"/joint{capsule.joint}/ball{i}{k}", 1.12 * radius,
                                        self._colour, position=end))
        return drawn

    def _control_points(self) -> list[Any]:
        """Draw control points as bands where they are on a link's axis, else as dots."""
        if not len(self._stage.obstacles):
            return []
        return [self._ball(f"/joint{point.joint}/point{k}", radius, _DARK, position=point.offset)
                for k, (point, radius) in enumerate(zip(self._stage.points[:-1],
                                                        _widths(self._stage), strict=False))]

    def _pointer(self) -> Any:
        """Draw the end effector's z axis."""
        tip = self._stage.points[-1]
        end = tip.offset + 0.85 * _AXIS * np.array(self._stage.robot.tool)[:, 2]
        return self._add_mesh(
            f"/joint{tip.joint}/axis",
            hull_of_balls((tip.offset, end), (_AXIS_WIDTH, _AXIS_WIDTH)), self._colour)

    def _draw_obstacles(self) -> None:
        for h, obstacle in enumerate(self._stage.obstacles.obstacles):
            self._obstacles[h].wxyz = _quaternion(np.asarray(obstacle.rotation, dtype=float))
            self._add_mesh(f"/obstacle{h}/body", obstacle_mesh(obstacle), rgb(ALERT),
                           flat_shading=obstacle.shape == "box")

    def _area(self, h: int, i: int, radius: float) -> Any:
        obstacle = self._stage.obstacles.obstacles[h]
        return self._add_mesh(f"/obstacle{h}/area{i}", obstacle_mesh(obstacle, radius), rgb(ALERT),
                              opacity=_AREA_OPACITIES[min(i, 1)], cast_shadow=False,
                              receive_shadow=False)

    def _frame(self, name: str) -> Any:
        return self._scene.add_frame(self._name + name, show_axes=False)

    def _ball(self, name: str, radius: float, colour: Rgb, **where: Any) -> Any:
        return self._scene.add_icosphere(self._name + name, radius, colour, **where)

    def _lines(self, name: str, points: Segments, colour: Rgb, pixels: float) -> Any:
        return self._scene.add_line_segments(self._name + name, points, colour, thickness=pixels,
                                             thickness_units="screen")

    def _add_mesh(self, name: str, mesh: Mesh, colour: Rgb, **look: Any) -> Any:
        return self._scene.add_mesh_simple(self._name + name, *mesh, color=colour, **look)


def _segments(points: Array | tuple[()]) -> Segments:
    """Return the line through points (N, 3), thinned, as segments (M, 2, 3)."""
    if len(points) < 2:
        return np.zeros((1, 2, 3), np.float32)
    kept = np.asarray(points)[_thinned(len(points))]
    return np.stack([kept[:-1], kept[1:]], axis=1).astype(np.float32)


def _widths(stage: Stage) -> Array:
    """Return a radius [m] at which each of the stage's points is visible on its link."""
    placements = stage.robot.placements(np.array(stage.robot.rest))
    points = place(placements, [point.joint for point in stage.points],
                   [point.offset for point in stage.points])
    radii = np.array([capsule.radius for capsule in stage.capsules])
    start, end = np.moveaxis(ends(stage.capsules, placements), -2, 0)
    along, from_start = end - start, points[:, None] - start
    share = np.clip((from_start * along).sum(-1) / np.maximum((along * along).sum(-1), 1e-12), 0, 1)
    off = np.linalg.norm(from_start - share[..., None] * along, axis=-1)  # (P, C)
    on = np.where(off < _ON_AXIS * radii, _SLIM * radii + _BAND, _DOT)
    return np.asarray(on.max(axis=1, initial=_DOT))


def _thinned(count: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, count - 1, _PATH_VERTICES).astype(np.int64))


def _linear(colours: NDArray[Any]) -> NDArray[np.uint8]:
    """Return colours from 0 to 255 in linear RGB, as the page expects for vertices."""
    return np.rint(255.0 * (colours / 255.0) ** 2.2).astype(np.uint8)


def _turn_z_to(axis: Array) -> Array:
    """Return the quaternion (4,), scalar first, that turns z to a unit vector (3,)."""
    if axis[2] < -1.0 + 1e-9:
        return np.array([0.0, 1.0, 0.0, 0.0])
    turn = np.array([1.0 + axis[2], -axis[1], axis[0], 0.0])
    return np.asarray(turn / np.linalg.norm(turn))


def _quaternion(rotation: Array) -> Array:
    """Return the quaternion (4,), scalar first, of a rotation (3, 3)."""
    from viser.transforms import SO3

    return np.asarray(SO3.from_matrix(rotation).wxyz)
