"""The errors of the tasks that a scenario lists, tick by tick."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress

import numpy as np

from hierarchy import Robot, State, Task
from hierarchy.problem import Array
from hierarchy.tasks import Along, CentreOfMass, Position
from hierarchy.tasks.pose import Pose
from scenarios.config.sections.tasks import JOINT, ListedTask
from scenarios.recording.recording import Recording


def error_of(name: str) -> str:
    """Name of the signal (T, m) with the error of a listed task."""
    return f"task_error_{name.replace(' ', '_')}"


def position_of(name: str) -> str:
    """Name of the signal (T, 3) [m] with the position of the point that a listed task moves."""
    return f"task_position_{name.replace(' ', '_')}"


def signals(robot: Robot, tasks: Iterable[Task], t: Array, q: Array, v: Array) -> dict[str, Array]:
    """Return error and position of listed tasks at t (T,) [s], q (T, nq), v (T, n).

    Rows of a state that is not finite, and those in which a task's error raises, are NaN.
    """
    tasks = tuple(task for task in tasks if not task.of_forces)  # what x is, not where the robot is
    state = State(robot)
    found = {error_of(task.name): np.full((len(t), task.dimension), np.nan) for task in tasks}
    found |= {position_of(task.name): np.full((len(t), 3), np.nan)
              for task in tasks if _position(task, state) is not None}
    readers = [_error_reader(task, state) for task in tasks]
    for k in range(len(t)):
        if not state.move(t[k], q[k], v[k]):
            continue
        for task, read in zip(tasks, readers, strict=True):
            with suppress(Exception):  # a user's code, which must not cost the run
                found[error_of(task.name)][k] = read()
            if (position := _position(task, state)) is not None:
                found[position_of(task.name)][k] = position
    return found


def _error_reader(task: Task, state: State) -> Callable[[], Array | float]:
    """Return what reads the error of a task; NaN for one that needs the measurement of a tick."""
    try:
        read = task.error_reader(state)
        read()
    except Exception:
        return lambda: np.nan
    return read


def _position(task: Task, state: State) -> Array | None:
    if isinstance(task, Along):
        task = task.task
    if isinstance(task, Position | Pose):
        return state.position(task.frame)
    return state.centre_of_mass() if isinstance(task, CentreOfMass) else None


def errors(recording: Recording) -> Iterator[tuple[ListedTask, str, Array]]:
    """Yield section, unit and size of the error (T,) of each listed task, the true one if known.

    A pose or frame comes twice, in [m] and [deg]; a pointing task in [deg], off its cone or outside
    it; a task that looks at a point in [deg].
    """
    units = recording.facts.robot.joint_units
    for section in recording.scenario.tasks:
        name = error_of(section.title)
        if name in recording:
            for unit, size in section.sizes(recording.true(name)):
                yield section, section.unit_among(units) if unit == JOINT else unit, size
