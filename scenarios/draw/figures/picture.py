"""The scene of a run in space: the arm, the path asked for, the path taken, the obstacles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from scenarios.draw.figures import drawing
from scenarios.draw.figures.drawing import ALERT, INK, Array

if TYPE_CHECKING:
    from hierarchy import Robot
    from hierarchy.avoidance import Obstacle, Obstacles
    from scenarios.loop.recording import Recording

_VERTICES = 1200
_OTHER_POSES = 5
_AREA_ALPHAS = (0.08, 0.18)  # of the outer and the inner area
_BALLS = 24  # that a capsule is drawn with
_NEAR = 1.0  # [m] from the end effector: what moves farther away is left out


def picture(recordings: Mapping[str, Recording], colours: Mapping[str, str] | None = None
            ) -> Figure:
    """Return the scene, after figure 3 of the letter.

    The arm is that of the first run, in full where its body is nearest to an obstacle, with the
    line to it and with its control points; every run's path has the colour of its label, or that
    given for it. A robot that branches is drawn by `scenarios.draw.figures.bodies`.
    """
    from scenarios.cell.robot import make_robot
    from scenarios.draw.figures import bodies

    first = next(iter(recordings.values()))
    robot = make_robot(first.scenario.robot)
    if bodies.branches(robot):
        return bodies.picture(robot, recordings, colours or drawing.colours(recordings))
    fig, (ax,) = drawing.figure(width=4.9, height=3.9)
    _obstacles(ax, first)
    _arms(ax, robot, first)
    chosen = drawing.colours(recordings) if colours is None else colours
    for label, colour in reversed(list(chosen.items())):
        _line(ax, recordings[label]["ee_position"], color=colour, linewidth=1.8)
    if "desired_position" in first:
        _line(ax, first["desired_position"], color=INK, linewidth=0.9, linestyle=(0, (3, 3)))
    ax.set_aspect("equal")
    ax.set_axis_off()
    return fig


def _line(ax: Axes, path: Array, **style: object) -> None:
    kept = path[:: max(1, len(path) // _VERTICES)]
    ax.plot(*drawing.project(kept).T, **style)  # type: ignore[arg-type]


def _obstacles(ax: Axes, recording: Recording) -> None:
    """Draw each obstacle that stands still with its areas, and those that move if they are near."""
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
    from scenarios.cell.obstacles import make_obstacles

    avoidance = recording.scenario.avoidance
    obstacles = make_obstacles(avoidance.placed if avoidance else ())
    obstacles.at(float(recording["t"][tick]))
    return obstacles


def _along(obstacle: Obstacle, centre: Array) -> Array:
    """Return places (P, 3) [m] such that balls around them make up a capsule; or the centre."""
    if obstacle.shape != "capsule":
        return centre[None]
    axis = np.asarray(obstacle.rotation, dtype=float)[:, 2] * obstacle.size[1]
    return np.asarray(centre + np.linspace(-1.0, 1.0, _BALLS)[:, None] * axis)


def _nearest(recording: Recording) -> int:
    """Return the tick in which the body is nearest to an obstacle, the last without any.

    Of distances seen by a camera it is that of the end effector, as in figure 8: the body's are
    often those to what an obstacle hides.
    """
    seen = "minimal_distance" if _exact(recording) else "ee_distance"
    return int(np.argmin(recording[seen])) if seen in recording else recording.ticks - 1


def _exact(recording: Recording) -> bool:
    return recording.scenario.sensor.kind == "exact"


def _arms(ax: Axes, robot: Robot, recording: Recording) -> None:
    from hierarchy import State
    from scenarios.scene import place

    nearest = _nearest(recording)
    others = np.linspace(0, recording.ticks - 1, _OTHER_POSES).astype(int)
    for k, alpha in (*((int(k), 0.16) for k in others), (nearest, 0.9)):
        placements = State.at(robot, recording["q"][k]).placements
        tip = recording["ee_position"][k]
        chain = drawing.project(np.vstack([np.zeros(3), placements[1:, 9:], tip]))
        ax.plot(*chain.T, color=INK, alpha=alpha, linewidth=5.0 if k == nearest else 2.5,
                solid_capstyle="round", solid_joinstyle="round")
        if k == nearest:
            ax.plot(*chain.T, "o", color=INK, markersize=6)
            points = robot.control_points
            body = place(placements, [p.joint for p in points], [p.offset for p in points])
            if len(body):
                ax.plot(*drawing.project(body).T, "o", color=ALERT, markersize=3)
                _shortest(ax, recording, k, body)


def _shortest(ax: Axes, recording: Recording, k: int, body: Array) -> None:
    """Link the control point that is nearest to an obstacle with it, as figure 3 does."""
    ends = _obstacles_at(recording, k).centres
    if ends.size and "control_point_distance" in recording and _exact(recording):
        point = body[int(np.argmin(recording["control_point_distance"][k]))]
        end = ends[int(np.argmin(np.linalg.norm(ends - point, axis=1)))]
        ax.plot(*drawing.project(np.array([point, end])).T, color=ALERT, linewidth=1.2)
