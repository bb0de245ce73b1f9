"""The picture of a robot that branches: its body at several times, side by side."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import INK, Array
from scenarios.recording.facts import RobotFacts
from scenarios.recording.recording import Recording
from scenarios.scene import ends

_POSES = 4
_APART = 1.1    # distance between bodies, in widths of the widest
_WIDTH, _HEADROOM = 6.4, 0.5  # of the figure [in]
_AZIMUTH, _ELEVATION = 40.0, 12.0  # [deg] of the camera: in front of a robot that looks along x
_AROUND = np.linspace(0.0, np.pi, 13)  # of half a rim
_VERTICES = 400
_LIGHT, _DARK = "#d5d9de", "#8d96a1"  # of links far away and near


def picture(recordings: Mapping[str, Recording], colours: Mapping[str, str]) -> Figure:
    """Return the first run's body at several times, with the paths of every run's tasks.

    Desired paths are dashed; actual paths, up to the time of the body, have the run's colour.
    """
    first = next(iter(recordings.values()))
    robot = first.facts.robot
    ticks = np.linspace(0, first.ticks - 1, _POSES).astype(int)
    width, lowest, highest = _extent(robot, first, ticks)
    apart = _APART * width
    fig, (ax,) = drawing.figure(width=_WIDTH, height=_HEADROOM + _WIDTH * (highest - lowest) / (
        _POSES * apart))
    for i, k in enumerate(ticks):
        aside = np.array([i * apart, 0.0])
        _body(ax, robot, first["q"][k], aside)
        for label, colour in reversed(list(colours.items())):
            run = recordings[label]
            for signal in (one for one in run.signals if one.startswith("task_position_")):
                path, name = run[signal], signal.removeprefix("task_position_")
                if "task_error_" + name in first and run is first:
                    error = run[f"task_error_{name}"]
                    if error.shape[1] >= 3:
                        _line(ax, path + error[:, :3], aside, color=INK, linewidth=0.7,
                              linestyle=(0, (3, 3)))
                _line(ax, path[:k + 1], aside, color=colour, linewidth=1.6)
        ax.text(i * apart, lowest - 0.03, f"{first['t'][k]:.1f} s",
                ha="center", va="top")
    ax.set_aspect("equal")
    ax.autoscale_view()
    ax.margins(0.02, 0.08)
    ax.set_axis_off()
    return fig


def _body(ax: Axes, robot: RobotFacts, q: Array, aside: Array) -> None:
    """Draw the capsules, the farthest first and lightest."""
    links = robot.capsules
    segments = ends(links, robot.placements(q))
    depth = segments.mean(axis=1) @ _toward_camera()
    order = np.argsort(depth)
    shade = (depth - depth.min()) / max(float(np.ptp(depth)), 1e-9)
    light, dark = (np.array([int(c[i:i + 2], 16) for i in (1, 3, 5)]) / 255
                   for c in (_LIGHT, _DARK))
    flat = _flat(segments)
    shapes = [Polygon(aside + outline(flat[i, 0], flat[i, 1], links[i].radius)) for i in order]
    ax.add_collection(PatchCollection(
        shapes, facecolors=[light + shade[i] * (dark - light) for i in order],
        edgecolors="white", linewidths=0.6))


def outline(start: Array, end: Array, radius: float) -> Array:
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


def _extent(robot: RobotFacts, recording: Recording, ticks: Array) -> tuple[float, float, float]:
    """Return the greatest width [m] of the drawn bodies, and their lowest and highest point."""
    links = robot.capsules
    radii = np.array([[link.radius] for link in links])
    flat = [_flat(ends(links, robot.placements(q))) for q in recording["q"][ticks]]
    low = np.array([(body - radii[..., None]).min(axis=(0, 1)) for body in flat])
    high = np.array([(body + radii[..., None]).max(axis=(0, 1)) for body in flat])
    return float((high - low)[:, 0].max()), float(low[:, 1].min()), float(high[:, 1].max())
