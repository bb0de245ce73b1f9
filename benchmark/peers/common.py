"""What pink and mink share, and steps until the error is small or does not fall, start by start."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmark.peers.scenes import Arm, Array, RefusedError

SOLVER = "daqp"      # of the quadratic programs of pink and mink
PERIOD = 0.1         # [s] of a step, of which the limits of speed allow one
LM = 1.0             # lm_damping of tasks in pink and mink, as in their examples
_MOST = 200          # iterations of each start
_STILL = 1e-3        # relative decrease of the error within `_PATIENCE` iterations that goes on
_PATIENCE = 10


def iterated(aim: Callable[[Array], None], at: Callable[[Array], float],
             step: Callable[[Array], Array], tolerance: float
             ) -> Callable[[Array, Array], tuple[Array, bool]]:
    """Return a solve made of three: take the poses, error at q, and the q after q."""
    def solve(poses: Array, starts: Array) -> tuple[Array, bool]:
        aim(poses)
        best, nearest = np.inf, starts[0]
        for start in starts:
            q, errors = start.copy(), list[float]()
            for k in range(_MOST):
                errors.append(at(q))
                if errors[-1] < best:
                    best, nearest = errors[-1], q.copy()
                if best <= tolerance:
                    return nearest, True
                if k >= _PATIENCE and min(errors[-_PATIENCE:]) > (
                        (1.0 - _STILL) * min(errors[:-_PATIENCE])):
                    break
                try:
                    q = step(q)
                except Exception:  # no solution of a step: the next start
                    break
        return nearest, False

    return solve


def of_tasks(configuration: Any, tasks: Sequence[Any], limits: tuple[Array, Array],
             pose: Callable[[Array], Any], velocity: Callable[[], Array], tolerance: float
             ) -> Callable[[Array, Array], tuple[Array, bool]]:
    """Return the solve of tasks of pink or mink, weighted alike, inside limits of positions.

    pose : makes the package's own of a matrix (4, 4). velocity : of a step.
    """
    def aim(poses: Array) -> None:
        for task, goal in zip(tasks, poses, strict=True):
            task.set_target(pose(goal))

    def at(q: Array) -> float:
        configuration.update(q)
        return float(np.linalg.norm([task.compute_error(configuration) for task in tasks]))

    return iterated(aim, at, lambda q: np.clip(q + velocity() * PERIOD, *limits), tolerance)


def position_only(task: type[Any]) -> type[Any]:
    """Return a frame's task with its position rows alone: costs select no rows of a constraint."""
    return type("PositionTask", (task,), {
        "compute_error": lambda self, at: np.asarray(task.compute_error(self, at)[:3]),
        "compute_jacobian": lambda self, at: np.asarray(task.compute_jacobian(self, at)[:3])})


def of_program(scene: Arm, configuration: Any, aim: Callable[[Array, Array], None],
               build: Callable[..., Any], position: Any, still: Sequence[Any], hard: bool
               ) -> tuple[Any, Any]:
    """Return velocity and resolve of pink or mink: the two steps of their `solve_ik`.

    aim : takes goal and rate of the path. build : their `build_ik`. position, still : the tasks,
    of which the first is a constraint if `hard`.
    """
    import qpsolvers  # placo's environment has none

    problem: Any = None
    for task in still:
        task.set_target(np.array(scene.posture))
    asked = {"tasks": still, "constraints": [position]} if hard else {"tasks": [position, *still]}

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        nonlocal problem
        configuration.update(q)
        aim(goal, rate)
        problem = build(configuration, dt=scene.period, **asked)
        found = resolve()
        if not found.found or found.x is None:
            raise RefusedError("no solution")
        return np.asarray(found.x / scene.period)

    def resolve() -> Any:
        return qpsolvers.solve_problem(problem, solver=SOLVER)

    return velocity, resolve
