"""The scene of a run in space: the arm, the path asked for, the path taken, the obstacles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from scenarios import drawing
from scenarios.drawing import ALERT, INK, Array

if TYPE_CHECKING:
    from hierarchy import Robot
    from scenarios.recording import Recording

_VERTICES = 1200
_OTHER_POSES = 5
_AREA_ALPHAS = (0.08, 0.18)  # of the outer and the inner area


def picture(recordings: Mapping[str, Recording], colours: Mapping[str, str] | None = None
            ) -> Figure:
    """Return the scene, after figure 3 of the letter.

    The arm is that of the first run, in full where its body is nearest to an obstacle, with the
    line to it and with its control points; every run's path has the colour of its label, or that
    given for it. A robot that branches is drawn by `scenarios.bodies`.
    """
    from scenarios import bodies
    from scenarios.making import make_robot

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
    """Draw each obstacle that stands still as the ball around it, with its areas."""
    avoidance = recording.scenario.avoidance
    if avoidance is None:
        return
    for obstacle in avoidance.obstacles:
        place = getattr(obstacle, "centre", obstacle)
        if place is None:
            continue
        x, y = drawing.project(np.asarray(place, dtype=float))
        size = getattr(obstacle, "radius", None) or 0.0
        areas = sorted(avoidance.thresholds.values(), reverse=True)
        for radius, alpha in zip((*areas, 0.0), (*_AREA_ALPHAS[-len(areas):], 1.0), strict=True):
            ax.add_patch(Circle((x, y), size + radius, color=ALERT, alpha=alpha, linewidth=0))
        ax.plot(x, y, "o", color=ALERT, markersize=5)


def _arms(ax: Axes, robot: Robot, recording: Recording) -> None:
    from scenarios.scene import place

    nearest = (int(np.argmin(recording["minimal_distance"]))
               if "minimal_distance" in recording else recording.ticks - 1)
    others = np.linspace(0, recording.ticks - 1, _OTHER_POSES).astype(int)
    for k, alpha in (*((int(k), 0.16) for k in others), (nearest, 0.9)):
        placements = robot.state(recording["q"][k]).placements
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
    avoidance = recording.scenario.avoidance
    still = [getattr(o, "centre", o) for o in avoidance.obstacles] if avoidance else []
    ends = np.array([place for place in still if place is not None], dtype=float)
    if ends.size and "control_point_distance" in recording:
        point = body[int(np.argmin(recording["control_point_distance"][k]))]
        end = ends[int(np.argmin(np.linalg.norm(ends - point, axis=1)))]
        ax.plot(*drawing.project(np.array([point, end])).T, color=ALERT, linewidth=1.2)
