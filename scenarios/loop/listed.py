"""The errors of the tasks that a scenario lists, tick by tick."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import numpy as np

from hierarchy import HierarchyError, Robot, State, Task
from hierarchy.problem import Array
from hierarchy.tasks import Along, CentreOfMass, Position
from hierarchy.tasks.pose import PoseTask

if TYPE_CHECKING:
    from scenarios.config.listed import ListedTask
    from scenarios.loop.recording import Recording


def error_of(name: str) -> str:
    """Name of the signal (T, m) with the error of a listed task."""
    return f"task_error_{name.replace(' ', '_')}"


def position_of(name: str) -> str:
    """Name of the signal (T, 3) [m] with the position of the point that a listed task moves."""
    return f"task_position_{name.replace(' ', '_')}"


def wanted(section: ListedTask, position: Array, error: Array) -> Array | None:
    """Return where a task wants the point (..., 3) [m] that it moves, or None if it does not say.

    In axes that the task leaves free that is where the point is.
    """
    if section.kind not in ("position", "pose"):
        return None
    axes, goal = ["xyz".index(axis) for axis in getattr(section, "axes", "xyz")], position.copy()
    goal[..., axes] += error[..., :len(axes)]
    return goal


def signals(robot: Robot, tasks: Iterable[Task], t: Array, q: Array, v: Array) -> dict[str, Array]:
    """Return error and position of listed tasks at t (T,) [s], q (T, nq), v (T, n).

    Rows of a state that is not finite are NaN.
    """
    tasks = tuple(task for task in tasks if not task.of_forces)  # what x is, not where the robot is
    state = State(robot)
    found = {error_of(task.name): np.full((len(t), task.dimension), np.nan) for task in tasks}
    found |= {position_of(task.name): np.full((len(t), 3), np.nan)
              for task in tasks if _position(task, state) is not None}
    for k in range(len(t)):
        if not state.move(t[k], q[k], v[k]):
            continue
        for task in tasks:
            found[error_of(task.name)][k] = _error(task, state)
            if (position := _position(task, state)) is not None:
                found[position_of(task.name)][k] = position
    return found


def _error(task: Task, state: State) -> Array | float:
    """The error of a task, NaN for a plugin's that needs the measurement of its tick."""
    try:
        return task.error(state)
    except (AttributeError, TypeError, HierarchyError):
        return np.nan


def _position(task: Task, state: State) -> Array | None:
    if isinstance(task, Along):
        task = task.task
    if isinstance(task, Position | PoseTask):
        return state.position(task.frame)
    return task.position(state) if isinstance(task, CentreOfMass) else None


def errors(recording: Recording) -> Iterator[tuple[ListedTask, str, Array]]:
    """Yield section, unit and size of the error (T,) of each listed task.

    A pose or frame comes twice, in [m] and [deg]; a pointing task in [deg], off its cone or outside
    it; a task that looks at a point in [deg].
    """
    from scenarios.config.listed import ListedPointing

    for section in recording.scenario.tasks:
        if error_of(section.title) not in recording:
            continue
        error = recording[error_of(section.title)]
        if section.kind in ("pose", "frame", "relative") and error.shape[1] == 6:
            yield section, "m", np.linalg.norm(error[:, :3], axis=1)
            yield section, "deg", np.degrees(np.linalg.norm(error[:, 3:], axis=1))
        elif isinstance(section, ListedPointing):
            cosine = np.clip(np.cos(np.radians(section.alpha_d)) - error[:, 0], -1.0, 1.0)
            beyond = np.degrees(np.arccos(cosine)) - section.alpha_d
            yield section, "deg", np.maximum(beyond, 0.0 if section.rows == "inequality"
                                             else -beyond)
        elif section.kind == "look-at":
            yield section, "deg", np.degrees(2 * np.arctan(np.linalg.norm(error, axis=1) / 2))
        else:
            missed = np.maximum(error, 0.0) if section.one_sided else error
            yield section, section.unit, np.linalg.norm(missed, axis=1)
