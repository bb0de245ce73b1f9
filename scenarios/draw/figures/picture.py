"""The scene of a run in space: the arm, its desired and actual path, the obstacles."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from hierarchy.avoidance import Obstacle, Obstacles
from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK, Array
from scenarios.recording.facts import RobotFacts
from scenarios.recording.recording import Recording

_VERTICES = 1200
_OTHER_POSES = 5
_AREA_ALPHAS = (0.08, 0.18)  # of the outer and the inner area
_BALLS = 24  # that a capsule is drawn with
_NEAR = 1.0  # [m] from the end effector: moving obstacles farther away are left out


def picture(recordings: Mapping[str, Recording], colours: Mapping[str, str] | None = None
            ) -> Figure:
    """Return the scene, after figure 3 of the letter.

    The arm is that of the first run, drawn dark when its body is nearest to an obstacle, with its
    control points and the line to that obstacle; every run's path has the colour given for its
    label, or that of its resolver. `scenarios.draw.figures.bodies` draws robots that branch.
    """
    from scenarios.draw.figures import bodies

    first = next(iter(recordings.values()))
    if not first.facts.robot.is_chain:
        return bodies.picture(recordings, colours or drawing.colours(recordings))
    fig, (ax,) = drawing.figure(width=4.9, height=3.9)
    _obstacles(ax, first)
    _arms(ax, first.facts.robot, first)
    chosen = drawing.colours(recordings) if colours is None else colours
    for label, colour in reversed(list(chosen.items())):
        _line(ax, recordings[label]["ee_position"], color=colour, linewidth=1.8)
    if "desired_position" in first:
        _line(ax, once(first["desired_position"]), color=INK, linewidth=0.9, linestyle=(0, (3, 3)))
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
    kept = path[:: max(1, len(path) // _VERTICES)]
    ax.plot(*drawing.project(kept).T, **style)  # type: ignore[arg-type]


def _obstacles(ax: Axes, recording: Recording) -> None:
    """Draw static obstacles with their areas, and moving ones that are near."""
    avoidance = recording.scenario.avoidance
    if avoidance is None:
        return
    areas = sorted(avoidance.thresholds.values(), reverse=True)
    tick = _nearest(recording)
    there, tip = _obstacles_at(recording, tick), recording["ee_position"][tick]
    for obstacle, centre in zip(there.obstacles, there.centres, strict=True):
        if obstacle.path is not None and np.linalg.norm(centre - tip) > _NEAR:
            continue
        radius = obstacle.size[0] if obstacle.size and obstacle.shape != "box" else 0.0
        for place in _along(obstacle, centre):
            _ball(ax, place, radius, 1.0)
        ax.plot(*drawing.project(centre), "o", color=ALERT, markersize=5)
        if obstacle.path is None:
            for area, alpha in zip(areas, _AREA_ALPHAS[-len(areas):], strict=True):
                _ball(ax, centre, radius + area, alpha)


def _ball(ax: Axes, centre: Array, radius: float, alpha: float) -> None:
    x, y = drawing.project(centre)
    ax.add_patch(Circle((x, y), radius, color=ALERT, alpha=alpha, linewidth=0))


def _obstacles_at(recording: Recording, tick: int) -> Obstacles:
    from scenarios.cell.sensors.sensor import make_obstacles

    avoidance = recording.scenario.avoidance
    obstacles = make_obstacles(avoidance.placed if avoidance else ())
    obstacles.at(float(recording["t"][tick]))
    return obstacles


def _along(obstacle: Obstacle, centre: Array) -> Array:
    """Return centres (P, 3) [m] of balls that make up a capsule; of other shapes the centre."""
    if obstacle.shape != "capsule":
        return centre[None]
    axis = np.asarray(obstacle.rotation, dtype=float)[:, 2] * obstacle.size[1]
    return np.asarray(centre + np.linspace(-1.0, 1.0, _BALLS)[:, None] * axis)


def _nearest(recording: Recording) -> int:
    """Return the tick in which the body is nearest to an obstacle, or the last tick.

    With images whose true distances are not known that of the end effector counts, as in figure 8:
    those of the body often belong to space that an obstacle hides.
    """
    seen = next((name for name in ("true_minimal_distance", "minimal_distance")
                 if name in recording and (name[:4] == "true" or _exact(recording))), "ee_distance")
    return int(np.argmin(recording[seen])) if seen in recording else recording.ticks - 1


def _exact(recording: Recording) -> bool:
    return recording.scenario.sensor.kind == "exact"


def _arms(ax: Axes, robot: RobotFacts, recording: Recording) -> None:
    from scenarios.scene import place

    nearest = _nearest(recording)
    others = np.linspace(0, recording.ticks - 1, _OTHER_POSES).astype(int)
    for k, alpha in (*((int(k), 0.16) for k in others), (nearest, 0.9)):
        placements = robot.placements(recording["q"][k])
        tip = recording["ee_position"][k]
        chain = drawing.project(np.vstack([np.zeros(3), placements[1:, 9:], tip]))
        ax.plot(*chain.T, color=INK, alpha=alpha, linewidth=5.0 if k == nearest else 2.5,
                solid_capstyle="round", solid_joinstyle="round")
        if k == nearest:
            ax.plot(*chain.T, "o", color=INK, markersize=6)
            points = robot.points[:-1]
            body = place(placements, [p.joint for p in points], [p.offset for p in points])
            if len(body):
                ax.plot(*drawing.project(body).T, "o", color=ALERT, markersize=3)
                _shortest(ax, recording, k, body)


def _shortest(ax: Axes, recording: Recording, k: int, body: Array) -> None:
    """Draw a line between the nearest control point and its obstacle, as in figure 3."""
    ends = _obstacles_at(recording, k).centres
    if ends.size and "control_point_distance" in recording and _exact(recording):
        point = body[int(np.argmin(recording["control_point_distance"][k]))]
        end = ends[int(np.argmin(np.linalg.norm(ends - point, axis=1)))]
        ax.plot(*drawing.project(np.array([point, end])).T, color=ALERT, linewidth=1.2)
