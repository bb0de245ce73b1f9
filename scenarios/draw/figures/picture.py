"""The scene of a run in space: the robot, its desired and actual paths, the obstacles."""

from collections.abc import Mapping
from itertools import product

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PatchCollection
from matplotlib.figure import Figure
from matplotlib.patches import Polygon
from scipy.spatial import ConvexHull

from hierarchy.avoidance import Obstacle
from hierarchy.problem import Array
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK
from scenarios.recording.facts import RobotFacts, ends
from scenarios.recording.recording import Recording
from scenarios.scene.drawn import Scene, moved_by_tasks, scene

_VERTICES = 800
_OTHER_POSES = 5
_AREA_ALPHAS = (0.08, 0.18)  # of the outer and the inner area
_HAIR = 1e-6  # [m] radius of an edge: a board without one has no area as seen along it
_NEAR = 1.0  # [m] from the end effector: moving obstacles farther away are left out
_DESIRED = (0, (3, 3))  # dashes

# Of a robot that branches:
_POSES = 4
_APART = 1.1    # distance between bodies, in widths of the widest
_WIDTH, _HEADROOM = 6.4, 0.5  # of the figure [in]
_AZIMUTH, _ELEVATION = 40.0, 12.0  # [deg] of the camera: in front of a robot that looks along x
_AROUND = np.linspace(0.0, np.pi, 13)  # of half a rim
_ROUND = np.column_stack([f(np.linspace(0.0, 2.0 * np.pi, 96)) for f in (np.cos, np.sin)])  # a rim
_LIGHT, _DARK = (0.835, 0.851, 0.871), (0.553, 0.588, 0.631)  # of links far away and near


def picture(recordings: Mapping[str, Recording], colours: Mapping[str, str] | None = None
            ) -> Figure:
    """Return the scene of the first run with every run's path, in the colour of its label.

    Robots that branch stand side by side, see `_bodies`. The arm of another is drawn as in figure 3
    of the letter, dark when its body is nearest to an obstacle, with its control points and the
    line to that obstacle.
    """
    chosen = drawing.colours(recordings) if colours is None else colours
    first = next(iter(recordings.values()))
    if not first.facts.robot.is_chain:
        return _bodies(recordings, chosen)
    fig, (ax,) = drawing.figure(width=4.9, height=3.9)
    tick = _nearest(first)
    seen = scene(first, ticks=np.array([tick]))
    _obstacles(ax, first, seen)
    _arms(ax, first, tick)
    _points(ax, seen, linked=_exact(first))
    for label, colour in reversed(list(chosen.items())):
        run = recordings[label]
        for actual in (run.true("ee_position"), *(moved.actual for moved in moved_by_tasks(run))):
            _line(ax, drawing.project(actual), color=colour, linewidth=1.8)
    wanted = [first["desired_position"]] if "desired_position" in first else []
    for path in (*wanted, *(m.wanted for m in moved_by_tasks(first) if m.wanted is not None)):
        _line(ax, drawing.project(once(path)), color=INK, linewidth=0.9, linestyle=_DESIRED)
    ax.set_aspect("equal")
    ax.set_axis_off()
    return fig


def once(path: Array) -> Array:
    """Return a path (T, 3) up to where it is back at its start: a second turn fills the dashes."""
    step = np.linalg.norm(np.diff(path, axis=0), axis=1).max(initial=0.0)
    away = np.linalg.norm(path - path[0], axis=1)
    left = int((away > away.max() / 2).argmax())
    back = np.flatnonzero(away[left:] <= step)
    return path[:left + back[0] + 1] if left and back.size else path


def _line(ax: Axes, path: Array, **style: object) -> None:
    """Draw a path (T, 2), thinned."""
    ax.plot(*path[:: max(1, len(path) // _VERTICES)].T, **style)  # type: ignore[arg-type]


def _obstacles(ax: Axes, recording: Recording, seen: Scene) -> None:
    """Draw the obstacles, static ones with their areas, and moving ones that are near the tip."""
    avoidance = recording.scenario.avoidance
    areas = sorted(avoidance.thresholds["body"].values(), reverse=True) if avoidance else []
    for obstacle, centre in zip(seen.obstacles.obstacles, seen.centres[0], strict=True):
        balls, radius = hull(obstacle)
        away = np.linalg.norm(centre - seen.points[0, -1]) - radius - np.linalg.norm(
            balls, axis=1).max()
        if obstacle.path is not None and away > _NEAR:
            continue
        ax.plot(*drawing.project(centre), "o", color=ALERT, markersize=5)
        flat = drawing.project(centre + balls)
        _hull(ax, flat, radius, 1.0)
        if obstacle.path is None:
            for area, alpha in zip(areas, _AREA_ALPHAS[-len(areas):], strict=True):
                _hull(ax, flat, radius + area, alpha)


def hull(obstacle: Obstacle) -> tuple[Array, float]:
    """Return an obstacle as the hull of balls: their centres (K, 3) from its own, and radius."""
    size, axes = obstacle.size, np.asarray(obstacle.rotation, dtype=float)
    corners = {"capsule": [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]],
               "box": list(product((1.0, -1.0), repeat=3))}.get(obstacle.shape, [[0.0, 0.0, 0.0]])
    half = size if obstacle.shape == "box" else size[1:]
    return (np.array(corners) * (half or 0.0)) @ axes.T, 0.0 if obstacle.shape == "box" else (
        size[0] if size else 0.0)


def _hull(ax: Axes, flat: Array, radius: float, alpha: float) -> None:
    """Draw the hull of discs about points (K, 2)."""
    if radius > 0.0 or len(flat) > 1:
        rims = (flat[:, None] + max(radius, _HAIR) * _ROUND).reshape(-1, 2)
        ax.add_patch(Polygon(rims[ConvexHull(rims).vertices], color=ALERT, alpha=alpha,
                             linewidth=0))


def _nearest(recording: Recording) -> int:
    """Return the tick in which the body is nearest to an obstacle, or the last tick.

    With images whose true distances are not known that of the end effector counts, as in figure 8:
    those of the body often belong to space that an obstacle hides.
    """
    seen = next((name for name in ("true_minimal_distance", "minimal_distance")
                 if name in recording and (name[:4] == "true" or _exact(recording))), "ee_distance")
    return (int(np.argmin(np.nan_to_num(recording[seen], nan=np.inf))) if seen in recording
            else recording.ticks - 1)


def _exact(recording: Recording) -> bool:
    return recording.scenario.sensor.kind == "exact"


def _arms(ax: Axes, recording: Recording, nearest: int) -> None:
    others = np.linspace(0, recording.ticks - 1, _OTHER_POSES).astype(int)
    for k, alpha in (*((int(k), 0.16) for k in others), (nearest, 0.9)):
        placements = recording.facts.robot.placements(recording.true("q")[k])
        tip = recording.true("ee_position")[k]
        chain = drawing.project(np.vstack([np.zeros(3), placements[1:, 9:], tip]))
        ax.plot(*chain.T, color=INK, alpha=alpha, linewidth=5.0 if k == nearest else 2.5,
                solid_capstyle="round", solid_joinstyle="round")
        if k == nearest:
            ax.plot(*chain.T, "o", color=INK, markersize=6)


def _points(ax: Axes, seen: Scene, linked: bool) -> None:
    """Draw the control points, and the shortest line to an obstacle, as in figure 3."""
    body, distance = seen.points[0, :-1], seen.distance[0, :-1]
    if len(body):
        ax.plot(*drawing.project(body).T, "o", color=ALERT, markersize=3)
    if linked and np.isfinite(distance).any():
        k = int(np.argmin(distance))
        ax.plot(*drawing.project(np.array([body[k], seen.nearest[0, k]])).T, color=ALERT,
                linewidth=1.2)


def _bodies(recordings: Mapping[str, Recording], colours: Mapping[str, str]) -> Figure:
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
        _body(ax, robot, first.true("q")[k], aside)
        for label, colour in reversed(list(colours.items())):
            run = recordings[label]
            for moved in moved_by_tasks(run):
                if run is first and moved.wanted is not None:
                    _line(ax, aside + _flat(moved.wanted), color=INK, linewidth=0.7,
                          linestyle=_DESIRED)
                _line(ax, aside + _flat(moved.actual[:k + 1]), color=colour, linewidth=1.6)
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
    a, e = np.radians([_AZIMUTH, _ELEVATION])
    depth = segments.mean(axis=1) @ [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
    order = np.argsort(depth)
    shade = (depth - depth.min()) / max(float(np.ptp(depth)), 1e-9)
    flat = _flat(segments)
    shapes = [Polygon(aside + outline(flat[i, 0], flat[i, 1], links[i].radius)) for i in order]
    ax.add_collection(PatchCollection(
        shapes, facecolors=np.array(_LIGHT) + np.outer(shade[order], np.subtract(_DARK, _LIGHT)),
        edgecolors="white", linewidths=0.6))


def outline(start: Array, end: Array, radius: float) -> Array:
    """Return the outline (N, 2) of a capsule seen from the side: two half circles."""
    along = np.arctan2(*(end - start)[::-1])
    angles = np.concatenate([along - np.pi / 2 + _AROUND, along + np.pi / 2 + _AROUND])
    centres = np.repeat([end, start], len(_AROUND), axis=0)
    return np.asarray(centres + radius * np.column_stack([np.cos(angles), np.sin(angles)]))


def _flat(points: Array) -> Array:
    return drawing.project(points, _AZIMUTH, _ELEVATION)


def _extent(robot: RobotFacts, recording: Recording, ticks: Array) -> tuple[float, float, float]:
    """Return the greatest width [m] of the drawn bodies, and their lowest and highest point."""
    flat = _flat(ends(robot.capsules, robot.placements(recording.true("q")[ticks])))
    radii = np.array([link.radius for link in robot.capsules])[:, None, None]
    low, high = (flat - radii).min(axis=(1, 2)), (flat + radii).max(axis=(1, 2))
    return float((high - low)[:, 0].max()), float(low[:, 1].min()), float(high[:, 1].max())
