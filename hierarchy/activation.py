"""Smooth activation of inequality tasks: how much each row of a stack acts, from 0 to 1.

With the value sigma of a task to be kept at sigma_min or more and the width beta of a buffer, the
activation is 1 up to sigma_min, 0 from sigma_min + beta on, and falls smoothly between them, as a
half wave of the cosine. Source: E. Simetti, G. Casalino, "A Novel Practical Technique to Integrate
Inequality Control Objectives and Task Transitions in Priority Based Control", Journal of
Intelligent and Robotic Systems (2016), which asks for a sigmoid and leaves its form open.
"""

from collections.abc import Mapping, Sequence
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import check_name, expect, expect_each, positive
from hierarchy.gate import array_of
from hierarchy.problem import Array, Hierarchy
from hierarchy.state import State
from hierarchy.task import Task


def activation(error: ArrayLike, buffer: float) -> Array:
    """Return the activation (m,) of rows whose errors are to the far end of their buffer.

    error : (m,) sigma_min + beta - sigma, in the unit of `buffer`, which is beta > 0.
    """
    width = positive("activation: buffer", buffer)
    share = np.clip(array_of("activation: error", error) / width, 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * share))


@final
class Activation:
    """The activations of the rows of `tasks` at a state as it moves, in their order.

    `buffers` are the widths by the name of a task, in the unit of its error; such a task aims at
    the far end of its buffer, so its error is zero there. The rows of other tasks always act.
    Raises HierarchyError if a width is not positive, or of none of the tasks.
    """

    def __init__(self, state: State, tasks: Sequence[Task], buffers: Mapping[str, float]) -> None:
        expect_each("activation: tasks", tasks, Task, "see hierarchy.tasks")
        expect("activation: buffers", buffers, Mapping, "give {task: width, ...}")
        for name, width in buffers.items():
            positive(f"task {name!r}: buffer", width)
            check_name("task of a buffer", name, [task.name for task in tasks])
        self._state, self._buffers = state, dict(buffers)
        self._tasks = [(task, np.ones(task.dimension)) for task in tasks]

    def __call__(self) -> Array:
        """Return the activations (m,)."""
        return np.hstack([np.empty(0), *(
            activation(task.error(self._state), self._buffers[task.name])
            if task.name in self._buffers else rows for task, rows in self._tasks)])

    def demanded(self, h: Hierarchy) -> Array:
        """Return the lower sides (m,) of h, without those of rows that do not act fully.

        Such a row is followed in part by design, so it cannot be missed. h has the rows of `tasks`.
        """
        return np.where(self() < 1.0, -np.inf, h.lower)
