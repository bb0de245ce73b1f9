"""The picture of a robot whose joints branch: its body at some times, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from scenarios import drawing
from scenarios.drawing import INK, Array
from scenarios.scene import capsules, ends

if TYPE_CHECKING:
    from hierarchy import Robot
    from scenarios.recording import Recording

_POSES = 4
_AZIMUTH, _ELEVATION = 40.0, 12.0  # [deg] of the camera: in front of a robot that looks along x
_AROUND = np.linspace(0.0, np.pi, 13)  # of half a rim
_VERTICES = 400
_LIGHT, _DARK = "#d5d9de", "#8d96a1"  # of links far away and near


def branches(robot: Robot) -> bool:
    """Whether the robot is more than one chain from a fixed base."""
    return robot.base == "floating" or any(
        parent != joint - 1 for joint, parent in enumerate(robot.parents) if joint > 0)


def picture(robot: Robot, recordings: Mapping[str, Recording],
            colours: Mapping[str, str]) -> Figure:
    """Return the first run's body at some times, and where every run's tasks went.

    Paths asked for are dashed; those taken, up to the time of the body, have the run's colour.
    """
    fig, (ax,) = drawing.figure(width=6.4, height=3.6)
    first = next(iter(recordings.values()))
    ticks = np.linspace(0, first.ticks - 1, _POSES).astype(int)
    apart = _width(robot, first, ticks)
    for i, k in enumerate(ticks):
        aside = np.array([i * apart, 0.0])
        _body(ax, robot, first["q"][k], aside)
        for label, colour in reversed(list(colours.items())):
            run = recordings[label]
            for name in _moved(run):
                path = run[f"task_position_{name}"]
                if "task_error_" + name in first and run is first:
                    error = run[f"task_error_{name}"]
                    if error.shape[1] >= 3:
                        _line(ax, path + error[:, :3], aside, color=INK, linewidth=0.7,
                              linestyle=(0, (3, 3)))
                _line(ax, path[:k + 1], aside, color=colour, linewidth=1.6)
        ax.text(i * apart, _lowest(robot, first["q"][k]) - 0.06, f"{first['t'][k]:.1f} s",
                ha="center", va="top")
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.margins(0.02, 0.08)
    ax.set_axis_off()
    return fig


def _moved(recording: Recording) -> list[str]:
    return [name.removeprefix("task_position_") for name in recording.signals
            if name.startswith("task_position_")]


def _body(ax: Axes, robot: Robot, q: Array, aside: Array) -> None:
    """Draw the capsules, those farther away first and lighter."""
    links = capsules(robot)
    segments = ends(links, robot.state(q).placements)
    depth = segments.mean(axis=1) @ _toward_camera()
    order = np.argsort(depth)
    shade = (depth - depth.min()) / max(float(np.ptp(depth)), 1e-9)
    light, dark = (np.array([int(c[i:i + 2], 16) for i in (1, 3, 5)]) / 255
                   for c in (_LIGHT, _DARK))
    flat = _flat(segments)
    shapes = [Polygon(aside + _outline(flat[i, 0], flat[i, 1], links[i].radius)) for i in order]
    ax.add_collection(PatchCollection(
        shapes, facecolors=[light + shade[i] * (dark - light) for i in order],
        edgecolors="white", linewidths=0.6))


def _outline(start: Array, end: Array, radius: float) -> Array:
    """Return the outline (N, 2) of a capsule seen from the side: two half circles."""
    along = np.arctan2(*(end - start)[::-1])
    angles = np.concatenate([along - np.pi / 2 + _AROUND, along + np.pi / 2 + _AROUND])
    centres = np.repeat([end, start], len(_AROUND), axis=0)
    return np.asarray(centres + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _toward_camera() -> Array:
    a, e = np.radians([_AZIMUTH, _ELEVATION])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def _flat(points: Array) -> Array:
    return drawing.project(points, _AZIMUTH, _ELEVATION)


def _line(ax: Axes, path: Array, aside: Array, **style: object) -> None:
    kept = path[:: max(1, len(path) // _VERTICES)]
    ax.plot(*(aside + _flat(kept)).T, **style)  # type: ignore[arg-type]


def _width(robot: Robot, recording: Recording, ticks: Array) -> float:
    """How far apart [m] the bodies are drawn: as wide as the widest, and some air."""
    links = capsules(robot)
    widths = [np.ptp(_flat(ends(links, robot.state(recording["q"][k]).placements))[..., 0])
              for k in ticks]
    return float(1.15 * max(widths) + 2 * max(link.radius for link in links))


def _lowest(robot: Robot, q: Array) -> float:
    return float(_flat(ends(capsules(robot), robot.state(q).placements))[..., 1].min())
