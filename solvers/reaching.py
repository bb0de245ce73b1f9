"""The configuration that serves tasks best, with restarts, and a verdict where none meets them."""

from collections.abc import Sequence
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, positive
from hierarchy.measured import Measured
from hierarchy.problem import Array, Hierarchy
from hierarchy.robot import Robot
from hierarchy.stack import Stack
from hierarchy.state import State
from hierarchy.task import Rows, Task, curved, parts, writer_in_stack
from hierarchy.tasks.joints.joint_limits import StepLimits
from hierarchy.tasks.joints.mechanism import Mechanism, above, bends, model_rows
from hierarchy.words import listed
from solvers.explain import nowhere
from solvers.resolver import Resolver
from solvers.resolvers.settled import Settled
from solvers.status import Status

_STARTS, _MOST = 20, 200  # starts, and iterations of each
_PERIOD = 0.1     # [s] for which the velocity of a step is held
_STEP = 0.3       # [rad or m] the largest change of a joint in one iteration
_SHARE = 0.1      # of the errors, in m: that of a joint that slides, where it is more
_STILL = 1e-3     # relative decrease of the errors in `_PATIENCE` iterations that goes on
_AT_REST = 1e-9   # the same at the end
_PATIENCE = 10
_MOVING = 1e-4    # [rad or m] step with which the end is not reached, whatever the errors do
_AT = 1e-6        # [rad or m] from a limit that counts as on it
_DRAWN, _POWER = 8, 3  # configurations at which rows of tasks are turned, and directions of each
_TURN = 1e-6      # [rad or m] how far
_MARGIN = 3.0     # for they may turn faster elsewhere, and all of twice that comes to rest at once
_WIDE = np.pi     # [rad or m] around q, from where a joint without a limit starts again


@final
@dataclass(frozen=True)
class Reached:
    """The answer of `reach`, best of all starts.

    q : (nq,) the configuration. met : whether the tasks that decide are met there.
    errors : norm of the error of each task, by name; of an inequality, of what is missed.
    verdict : "reached", or "unreachable: nearest found, ..." with the tasks that are missed and
        the joint limits, tasks above and singular directions that hold them back.
    iterations, starts : what it took. status : that of the last solve.
    """

    q: Array
    met: bool
    errors: dict[str, float]
    verdict: str
    iterations: int
    starts: int
    status: Status


def reach(robot: Robot, q: ArrayLike, tasks: Sequence[Task], until: float, *, limits: bool = True,
          resolver: Resolver, t: float = 0.0, damping: float = 1.0) -> Reached:
    """Return the configuration near q in which the tasks are met, in strict order, at time t.

    Gauss-Newton steps of the same problem as `solve_ik`, each at most 0.3 rad, and 0.3 m or a tenth
    of the errors, for the whole error of each task whatever its gain. Where the errors stop
    falling, they start again from a random configuration within the limits, the same ones in each
    call. These steps are undamped, which finds more; from the end of the first start, and of the
    best, damped ones go on to the nearest, and the latter is the answer where it is nearer by
    `until`. Joint tasks such as a posture are preferences: they do not decide whether the others
    are met, but where; their gains count relative to the largest of all.

    until : largest norm of the error of each task that decides, in its unit.

    Raises HierarchyError as `solve_ik` does, and if no task decides.
    """
    positive("solve_ik: until", until)
    search = _Search(State.at(robot, q, t=t), tasks, until, limits, resolver, damping)
    rng, start = np.random.default_rng(0), search.within_limits(search.state.q.copy())
    first = best = search.descend(start, resolver)
    iterations, count = best[2], 1
    while max(best[0]) > until and count < _STARTS:
        found = search.descend(_drawn(robot, start, rng), resolver)
        iterations, count = iterations + found[2], count + 1
        best = min(best, found, key=lambda one: one[0])
    if max(best[0]) > until:
        ends = [search.descend(q, search.settled, _AT_REST, min(until, 1.0) ** (0.5 / _MOST))
                for q in (first[1], best[1])]
        best = min(ends, key=lambda one: [error // until for error in one[0]])
        iterations += sum(end[2] for end in ends)
    return search.answer(best[1], iterations, count)


def stacked(robot: Robot, tasks: Sequence[Task], period: float, limits: Sequence[Task],
            resolver: Resolver, damping: float) -> tuple[Stack, Settled]:
    """Return tasks below limits and the robot's mechanism as a stack, and what resolves it.

    period [s], for which a velocity will be held; damping as in `solve_ik`.
    """
    first = above(model_rows(robot, period), limits, resolver.can_resolve("inequalities"))
    tasks = [task.on(robot) for task in tasks]
    return Stack([*first, *tasks], "velocity"), settled(robot, tasks, period, resolver, damping)


def settled(robot: Robot, tasks: Sequence[Task], period: float, resolver: Resolver,
            damping: float) -> Settled:
    """Return what resolves levels of tasks, as a robot has them, with those out of reach at rest.

    period [s], for which a velocity will be held; damping as in `solve_ik`.
    """
    names = curved(tasks, robot.n - robot.actuated)
    bent = {task.name: _bend(task, robot) for task in tasks
            if damping and task.name in names  # and all rows that count may vanish together
            and (isinstance(task, Measured) if task.kind == "inequality" else task.dimension == 1)}
    return Settled(inner=resolver, period=period, softness=damping, curved=names, bends=bent,
                   geared=not bends(robot))


def _bend(task: Task, robot: Robot) -> float:
    """Return how fast the rows of a task turn at some configurations, by the power method.

    In units of the rows per rad or m, times `_MARGIN`.
    """
    rng, state, still = np.random.default_rng(0), State.at(robot, robot.rest), np.zeros(robot.n)
    rows, found = Rows.empty(task.dimension, robot.n), [0.0]

    def turned(q: Array) -> Array:
        state.move(0.0, q, still)
        write()
        return rows.A.copy()

    for _ in range(_DRAWN):
        q, direction = _drawn(robot, robot.rest, rng), rng.normal(size=robot.n)
        with suppress(Exception):  # a user's may have no rows there, and some need a measurement
            write = writer_in_stack(task, state, "velocity", rows)
            here = turned(q)
            for _ in range(_POWER):
                step = _TURN / np.linalg.norm(direction) * direction
                turn = turned(robot.integrate(q, step)) - here
                _, (most, *_), (direction, *_) = np.linalg.svd(turn, full_matrices=False)
            found.append(float(most))
    return _MARGIN / _TURN * max(found)


class _Search:
    """A stack over one state, and the resolver of its steps."""

    def __init__(self, state: State, tasks: Sequence[Task], until: float, limits: bool,
                 resolver: Resolver, damping: float) -> None:
        robot, fastest = state.robot, max([1e-3, *map(_fastest, tasks)])
        self.robot, self.until, self.t, self.tasks = robot, until, state.t, list(tasks)
        self.slides = np.array([unit == "m" for unit in robot.velocity_units])
        quick = copy(robot)  # a configuration has no speed: slow joints turn at 1 rad/s
        quick.velocity_limit = np.where(robot.velocity_limit > 0.0, np.where(
            self.slides, np.inf, np.maximum(robot.velocity_limit, 1.0)), 0.0)
        self.limits = [StepLimits(quick, _PERIOD, 1.0 / _PERIOD)] if limits else []
        free: Array = np.full(robot.n, np.inf)
        self.lower, self.upper = robot.position_limits() if limits else (-free, free)
        self.stack, self.settled = stacked(robot, tasks, _PERIOD, self.limits, resolver, damping)
        self.mechanism = Mechanism(robot)
        self.deciding = [task for task in tasks if not task.straight]
        if not self.deciding:
            raise HierarchyError("solve_ik: until: only joint tasks are given, which are "
                                 "preferences; give a task of a frame too")
        # Sides times the factor ask for the whole error of a task that decides, or of the fastest.
        factors = [1.0 / (_PERIOD * ((not task.straight and _fastest(task)) or fastest))
                   for task in tasks]
        self.changed = [(task, factor) for task, factor in zip(tasks, factors, strict=True)
                        if factor != 1.0 or np.any(task.desired_velocity(state))]
        self.state, self.status = state, Status.SOLVED
        self._read = {task.name: task.error_reader(state) for task in tasks}

    def within_limits(self, q: Array) -> Array:
        """Return q with the joints that are beyond a limit on it, from which steps do not leave."""
        step = self._inward(q)
        return self.mechanism.closed(self.robot.integrate(q, step)) if step.any() else q

    def _inward(self, q: Array) -> Array:
        """Return the step (n,) of each joint to its range, zero inside it or without limits."""
        here = q[self.robot.coordinates]
        return np.asarray(np.minimum(np.maximum(here, self.lower), self.upper) - here)

    def descend(self, q: Array, resolver: Resolver, still: float = _STILL, shrink: float = 1.0
                ) -> tuple[list[float], Array, int]:
        """Return the errors of the deciding tasks, where they are least, and the iterations.

        A step takes tasks that are met off by its square. Steps that `shrink` by this factor each
        let them recover, who else keep the answer where they were met to begin with.
        """
        best, memory, history, moved = ([np.inf], q), None, list[float](), 0.0
        for k in range(_MOST):
            errors = self._errors(q)
            if errors < best[0]:
                best = errors, q
            history.append(sum(errors))
            done = max(errors) <= self.until
            if done or (k >= _PATIENCE and (shrink == 1.0 or moved < _MOVING)
                        and min(history[-_PATIENCE:])
                        > (1.0 - still) * min(history[:-_PATIENCE])):
                return (errors, q, k) if done else (*best, k)
            found = resolver.solve(self._rows(), memory)
            self.status, memory = found.status, found.memory
            step = self._shortened(found.x * _PERIOD, max(errors), shrink**k)
            moved = abs(step).max()
            q = self.mechanism.closed(self.robot.integrate(q, step))
        return (*best, _MOST)

    def _shortened(self, step: Array, error: float, share: float) -> Array:
        """Return a step along another (n,), no longer than a share of what the errors allow."""
        longest = np.where(self.slides, max(_STEP, _SHARE * error), _STEP) * share
        return np.asarray(step / max(1.0, (np.abs(step) / longest).max()))

    def _rows(self) -> Hierarchy:
        """Return the problem of a step as if targets stood still, for t does."""
        h = self.stack.hierarchy(self.state)
        lower, upper = h.lower.copy(), h.upper.copy()
        for task, factor in self.changed:
            k, ahead = h.names.index(task.name), task.desired_velocity(self.state)
            rows = slice(h.offsets[k], h.offsets[k + 1])
            lower[rows] = factor * (lower[rows] - ahead)
            upper[rows] = factor * (upper[rows] - ahead)
        return h.changed(lower=lower, upper=upper) if self.changed else h

    def _errors(self, q: Array) -> list[float]:
        """Move to q and return the norm of the error of each deciding task, `until` if it is met.

        What is left below that, rounding, must not outweigh the tasks below. What comes first is
        how far q is open or beyond limits, where it starts or the two contradict each other.
        """
        self.state.move(self.t, q, np.zeros(self.robot.n))
        broken = self._broken(q)
        return [broken and broken + self.until,  # no such q ends a search
                *(max(self._missed(task), self.until) for task in self.deciding)]

    def _broken(self, q: Array) -> float:
        """Return by how much q is beyond limits or its mechanism open [rad or m], 0 if rounding."""
        broken = max(float(np.abs(self._inward(q)).max()), self.mechanism.gap(q)[0])
        return broken if broken > _AT else 0.0

    def _missed(self, task: Task) -> float:
        error = self._read[task.name]()
        if not np.isfinite(error).all():  # the text takes longer than the rest
            task.refuse(True, f"its error is not finite: {error}")
        return float(np.linalg.norm(np.maximum(error, 0.0) if task.kind == "inequality"
                                    else error))

    def answer(self, q: Array, iterations: int, starts: int) -> Reached:
        """Return what is to be said of a configuration."""
        self.state.move(self.t, q, np.zeros(self.robot.n))
        broken, errors = self._broken(q), {task.name: self._missed(task) for task in self.tasks}
        met = all(errors[task.name] <= self.until for task in self.deciding)
        if not met:
            said = self._verdict(errors)
        elif broken:
            said = ("unreachable: nearest found is beyond limits, or its mechanism open, by "
                    f"{broken:.3g}")
        else:
            said = "reached"
        return Reached(q, met and not broken, errors, said, iterations, starts, self.status)

    def _verdict(self, errors: dict[str, float]) -> str:
        """Say what holds back the first task that is not met."""
        task = next(one for one in self.deciding if errors[one.name] > self.until)
        h = self._rows()
        k = h.names.index(task.name)
        rows = slice(h.offsets[k], h.offsets[k + 1])
        asked = h.slacks(np.zeros(h.n))[rows]
        pull = h.A[rows].T @ asked
        held = [*self._limits_at(-pull), *_above(h, k, -pull, self.limits)]
        nearest = "it is as near as the robot comes" if self.settled.strict else (
            f"{self.settled.label} is not strict, and may trade it for other tasks")
        said = nowhere(h, k, self.stack[task.name].row_names, np.zeros(h.n))
        by = f", held back by {listed(held)}" if held else f": {said}" if said else (
            f": {nearest}" if asked.any() else
            f": its rows ask for no velocity, its gain is {task.gain:g}")
        return (f"unreachable: nearest found, {task.name} is missed by "
                f"{errors[task.name]:.3g}{by}")

    def _limits_at(self, wanted: Array) -> list[str]:
        """Name the position limits against which a task pulls, `wanted` (n,) being its pull."""
        q = self.state.q[self.robot.coordinates]
        return [f"{name} at its {'upper' if pull > 0.0 else 'lower'} limit"
                for name, low, up, here, pull in zip(self.robot.velocity_names, self.lower,
                                                     self.upper, q, wanted, strict=True)
                if (pull > 0.0 and here > up - _AT) or (pull < 0.0 and here < low + _AT)]


def _above(h: Hierarchy, k: int, wanted: Array, limits: Sequence[Task]) -> list[str]:
    """Name the tasks above level k that keep it from moving as `wanted` (n,).

    A row does that has no room left on one of its sides, and would leave it.
    """
    own, names = {task.name for task in limits}, list[str]()
    for name, (A, lower, upper) in zip(h.names[:k], h.levels(), strict=False):
        sizes = np.linalg.norm(A, axis=1) * np.linalg.norm(wanted)
        along, equal = A @ wanted / np.where(sizes > 0.0, sizes, 1.0), lower == upper
        blocks = ((along < -_AT) & (equal | (lower > -_AT))
                  | (along > _AT) & (equal | (upper < _AT)))
        if name not in own and blocks.any():
            names.append(name)
    return names


def _fastest(task: Task) -> float:
    """Return the largest gain or rate [1/s] of a task and of those in it."""
    both = [task, *parts(task)]
    gains = [float(np.max(np.asarray(part.gain, dtype=float), initial=0.0)) for part in both]
    rates: list[float] = [part.barrier.rate for part in both if hasattr(part, "barrier")]
    return max([*gains, *rates])


def _drawn(robot: Robot, q: Array, rng: np.random.Generator) -> Array:
    """Return q with its actuated joints drawn anew, within their limits."""
    (lower, upper), here = robot.position_limits(), q[robot.coordinates]
    step = rng.uniform(np.where(lower > -np.inf, lower, np.minimum(here, upper) - _WIDE),
                       np.where(upper < np.inf, upper, np.maximum(here, lower) + _WIDE)) - here
    step[:robot.actuated] = 0.0
    return robot.integrate(q, step)
