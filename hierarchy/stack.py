"""Stack: named tasks in order of priority, turned into a Hierarchy at a State."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.avoidance.measurement import Measurement
from hierarchy.contacts import Contacts
from hierarchy.errors import (
    HierarchyError,
    ReadingError,
    check_name,
    expect,
    is_one_of,
    naming,
    refuse,
    text,
    whole,
)
from hierarchy.gate import Sizes, checked_give, checked_metric
from hierarchy.jit import bind, compiled
from hierarchy.problem import Array, Hierarchy
from hierarchy.state import State
from hierarchy.task import Level, Rows, Task, writer_in_stack


class _Prepared(NamedTuple):
    """The buffers of one order and the writers of its tasks, for one state and its measurement.

    Tasks bind their kernels to these arrays once, so that a tick does no look-ups. `hierarchy` is
    what callers get, who may set other arrays, and other `rows` then; `kept` has the buffers.
    """

    hierarchy: Hierarchy
    rows: tuple[Array, Array, Array, Sizes]
    kept: Hierarchy
    state: State
    seen: Measurement | None
    writers: tuple[Callable[[], object], ...]


class Stack:
    """Tasks by name, most important first.

    tasks : with different names.
    level : "velocity", "acceleration" or "torque", the meaning of x in the hierarchy: joint
        velocities, joint accelerations, or accelerations and contact forces, see `Contacts`.
    reference : a joint task (posture, damping) whose value is the hierarchy's reference, the
        null-space term of eq. (14); None for zero. That of forces is zero.
    contacts : at level "torque" only, where they are required; `Contacts(robot)` for none.
    metric : W of the hierarchy, see `Hierarchy`: (n, n), or "mass" for M(q) of each state; None for
        the identity.
    give : by name of a task, how far its rows may give, see `Hierarchy`: one number or (m,).

    Raises HierarchyError for an unknown level or metric, contacts missing or not needed, a task of
    contact forces at another level or of other contacts than the stack's, or a give of no task.
    """

    def __init__(self, tasks: Iterable[Task] = (), level: Level = "acceleration",
                 reference: Task | None = None, contacts: Contacts | None = None,
                 metric: ArrayLike | Literal["mass"] | None = None,
                 give: Mapping[str, ArrayLike] | None = None) -> None:
        refuse(not is_one_of(level, get_args(Level)), "level must be 'velocity', 'acceleration' or "
               f"'torque', got {level!r}")
        if (level == "torque") != (contacts is not None):
            raise HierarchyError(
                "level 'torque' needs contacts, Contacts(robot) for none" if contacts is None else
                f"contacts need the level 'torque', not {level!r}")
        self.level: Level = level
        self.contacts = contacts
        if isinstance(metric, str):
            refuse(metric != "mass", f"metric must be (n, n), 'mass' or None, got {metric!r}")
            refuse(contacts and contacts.contacts, "metric 'mass' is over accelerations alone, and "
                   "contact forces have no mass; give a metric over both")
        elif metric is not None:
            metric = checked_metric(metric)
        self._metric = metric
        self._tasks: dict[str, Task] = {}
        self._order: tuple[str, ...] = ()
        self._prepared: dict[tuple[str, ...], _Prepared] = {}
        self.reference = reference
        expect("tasks of a stack", tasks, Iterable, "give a list of tasks")
        for task in tasks:
            self.insert(task)
        give = {} if give is None else give
        expect("give of a stack", give, Mapping, "give a number by the name of a task")
        self._give = dict(give)
        for name in give:
            self._room(name)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the tasks, most important first."""
        return self._order

    @property
    def reference(self) -> Task | None:
        """The task whose value is the hierarchy's reference, which can be set."""
        return self._reference

    @reference.setter
    def reference(self, task: Task | None) -> None:
        if task is not None:
            expect("reference of a stack", task, Task, "give a task such as Posture")
        self._reference = task
        self._prepared.clear()

    def __len__(self) -> int:
        return len(self._order)

    def __getstate__(self) -> dict[str, object]:
        """Everything but the buffers, of which a copy makes its own."""
        return vars(self) | {"_tasks": dict(self._tasks), "_prepared": {}}

    def __repr__(self) -> str:
        return f"Stack({' > '.join(self._order)}; {self.level} level)"

    def __getitem__(self, name: str) -> Task:
        check_name("task", name, self._tasks)
        return self._tasks[name]

    def insert(self, task: Task, index: int | None = None) -> None:
        """Insert a task at `index` of the order, 0 being the most important; None for the end."""
        expect("a stack", task, Task, "a task says itself what it moves; see hierarchy.tasks")
        text(f"{type(task).__name__}: name", task.name)
        refuse(task.name in self._tasks, f"the stack already has a task {task.name!r}; "
               "give each its own name")
        if task.of_forces and (self.level == "torque" or task.contacts is not None):
            refuse(self.level != "torque", f"task {task.name!r}: contact forces need the level "
                   f"'torque', not {self.level!r}")
            refuse(task.contacts is not self.contacts, f"task {task.name!r}: its contacts are not "
                   "those of the stack; give both the same object")
        position = len(self._order) if index is None else index
        expect(f"task {task.name!r}: index", position, int, "0 is the most important")
        refuse(not 0 <= position <= len(self._order), f"task {task.name!r}: index {index} is "
               f"outside 0 .. {len(self._order)}")
        self._tasks[task.name] = task
        self._order = (*self._order[:position], task.name, *self._order[position:])

    def remove(self, name: str) -> Task:
        """Remove a task and return it; UnknownNameError if it is not in the stack."""
        task = self[name]
        del self._tasks[name]
        self._order = tuple(other for other in self._order if other != name)
        self._prepared.clear()
        return task

    def swap(self, first: str, second: str) -> None:
        """Exchange the places of two tasks."""
        place = {self[first].name: second, self[second].name: first}
        self._order = tuple(place.get(name, name) for name in self._order)

    def reorder(self, order: Sequence[str]) -> None:
        """Set the order of all tasks; HierarchyError unless each is named once."""
        expect("order of a stack", order, Sequence, "give a list of names of tasks")
        for name in order:
            self[name]
        refuse(sorted(order) != sorted(self._order), f"reorder needs each of {list(self._order)} "
               f"once, got {list(order)}")
        self._order = tuple(order)

    def row_names(self, order: Sequence[str] | None = None) -> tuple[str, ...]:
        """Return what each row of `hierarchy` is about, in its order; None for the stack's own."""
        return tuple(name for task in self._named(order) for name in self[task].row_names)

    def _named(self, order: Sequence[str] | None) -> tuple[str, ...]:
        if order is None:
            return self._order
        if type(order) is tuple:  # as in a tick, which has no time for checks
            return order
        expect("order of a stack", order, Sequence, "give a list of names of tasks")
        return tuple(self[name].name for name in order)

    def hierarchy(self, state: State, order: Sequence[str] | None = None) -> Hierarchy:
        """Write the tasks' rows at a state and return them as a Hierarchy.

        `order` names some or all of the tasks, most important first; None takes the stack's own.
        The arrays are buffers of this stack: the next call with the same order overwrites them, and
        does not return one in which another array was set.
        Raises ReadingError if the last `move` of the state was to positions that are not finite,
        and HierarchyError where the sides of a row cross.
        """
        order = self._named(order)
        prepared = self._prepared.get(order)
        if (prepared is None or prepared.state is not state
                or prepared.seen is not state.measurement):
            prepared = self.prepare(state, order)
        if not state.sound:
            raise ReadingError(f"robot {state.robot.name!r}: a joint position or velocity that was "
                               f"read after t = {state.t:g} s is not finite; stop the robot")
        for write in prepared.writers:
            write()
        h = prepared.hierarchy
        if h.rows is not prepared.rows:
            h = prepared.kept.changed()
            self._prepared[order] = prepared._replace(hierarchy=h, rows=h.rows)
        return h

    def prepare(self, state: State, order: tuple[str, ...]) -> _Prepared:
        """Bind the tasks of an order to a state now rather than in the first tick that uses it."""
        expect("Stack.hierarchy: state", state, State, "make one with State.at(robot, q)")
        refuse(not self._tasks, "the stack is empty: there are no tasks")
        tasks = {name: task.on(state.robot) for name, task in self._tasks.items()}
        reference = None if self.reference is None else self.reference.on(state.robot)
        if any(known.state.robot is not state.robot for known in self._prepared.values()):
            self._prepared.clear()  # another robot has other rows, and other names of them
        self._tasks, self._reference = tasks, reference
        known = self._prepared.get(order)
        h = self._buffers(order, state.n) if known is None else known.kept
        if self._metric is not None:  # M is symmetric, and its transpose is C-contiguous
            with naming(f"metric {self._metric!r}"):
                metric = state.dynamics.M.T if isinstance(self._metric, str) else self._metric
            h = h.changed(metric=metric)
        rows = Rows(h.A, h.lower, h.upper)
        writers = [writer_in_stack(self[name], state, self.level, own)
                   for name, own in zip(order, rows.split(h.sizes.tolist()), strict=True)]
        if self.reference is not None:
            writers.append(self._reference_writer(self.reference, h, state))
        writers.append(self._sides_checked(h, order))
        given = h.changed()
        prepared = _Prepared(given, given.rows, h, state, state.measurement, tuple(writers))
        self._prepared[order] = prepared
        return prepared

    def _reference_writer(self, task: Task, h: Hierarchy, state: State) -> Callable[[], object]:
        """Return what writes the reference of h; HierarchyError for a task of anything but joints.

        Its rows are those of the identity, without those of a floating base or with them.
        """
        first = max(state.n - task.dimension, 0)
        joints, A = h.reference[first:state.n], np.zeros((task.dimension, state.n))
        write = writer_in_stack(task, state, self.level, Rows(A, joints, joints))
        if task.dimension in (state.n, state.n - state.robot.actuated):
            write()
        task.refuse(task.kind != "equality" or not np.array_equal(A, np.eye(state.n)[first:]),
                    "the reference of a stack has a row for each joint, as a posture or damping")
        return write

    def _sides_checked(self, h: Hierarchy, order: tuple[str, ...]) -> Callable[[], object]:
        """Return a function that raises a HierarchyError where the sides of a row cross."""
        first_crossed = bind(_crossed, h.lower, h.upper)

        def check() -> None:
            if (i := first_crossed()) >= 0:
                level = int((h.offsets[1:] <= i).sum())
                row = self[order[level]].row_names[i - h.offsets[level]]
                raise HierarchyError(f"task {order[level]!r}, {row}: no value lies between lower "
                                     f"{h.lower[i]:g} and upper {h.upper[i]:g}")

        return check

    def _room(self, name: str) -> Array:
        """Return what each row of a task gives (m,); another task may have had its name before."""
        return checked_give(f"task {name!r}", self._give.get(name, 0.0), self[name].dimension)

    def _buffers(self, order: tuple[str, ...], joints: int) -> Hierarchy:
        n = joints if self.contacts is None else self.contacts.unknowns
        sizes = [whole(f"task {name!r}: dimension", self[name].dimension) for name in order]
        m = sum(sizes)
        give = np.concatenate([np.empty(0), *(map(self._room, order) if self._give else ())])
        return Hierarchy.trusted(np.zeros((m, n)), np.zeros(m), np.zeros(m), sizes, names=order,
                                 give=give if give.any() else None,
                                 named=partial(self.row_names, order))


@compiled
def _crossed(lower, upper):
    """Return the first row whose lower side is above its upper one, or -1."""
    for i in range(len(lower)):
        if lower[i] > upper[i]:
            return i
    return -1
