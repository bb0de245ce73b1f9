"""pink: tasks weighted in one quadratic program, or the position as its constraint."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import qpsolvers
from pink import Configuration, build_ik, solve_ik
from pink.exceptions import NoSolutionFound
from pink.limits import VelocityLimit
from pink.tasks import FrameTask, PostureTask

from benchmark.peers.iterated import LM, PERIOD, iterated
from benchmark.peers.scenes import Arm, Array

_SOLVER = "daqp"


class _PositionTask(FrameTask):  # type: ignore[misc]
    """Only the position rows of a frame: costs do not select rows of a constraint."""

    def compute_error(self, configuration: Configuration) -> Array:
        return np.asarray(super().compute_error(configuration)[:3])

    def compute_jacobian(self, configuration: Configuration) -> Array:
        return np.asarray(super().compute_jacobian(configuration)[:3])


def arm(scene: Arm, posture: bool, hard: bool = False) -> tuple[Any, Any]:
    """The two steps of `pink.solve_ik`.

    The end effector's target is its position after one period with its current rotation, which
    requests the scene's velocity and no rotation.
    """
    model = pin.buildModelFromUrdf(scene.file)
    configuration = Configuration(model, model.createData(), np.array(scene.start))
    position = (_PositionTask if hard else FrameTask)(scene.frame, position_cost=scene.ratio,
                                                      orientation_cost=0.0)
    tasks = [PostureTask(cost=1.0, gain=scene.posture_gain * scene.period)] if posture else []
    for task in tasks:
        task.set_target(np.array(scene.posture))
    limits = [VelocityLimit(model, np.array(scene.limit))]
    problem: Any = None

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        nonlocal problem
        configuration.update(q)
        now = configuration.get_transform_frame_to_world(scene.frame)
        asked = rate + scene.gain * (goal - now.translation)
        position.set_target(pin.SE3(now.rotation, now.translation + scene.period * asked))
        configuration.check_limits(safety_break=True)
        problem = build_ik(configuration, tasks if hard else [position, *tasks], scene.period,
                           limits=limits, constraints=[position] if hard else None)
        found = resolve()
        if not found.found or found.x is None:
            raise NoSolutionFound(problem, found)
        return np.asarray(found.x / scene.period)

    def resolve() -> qpsolvers.Solution:
        return qpsolvers.solve_problem(problem, solver=_SOLVER)

    return velocity, resolve


def reach(file: str, frames: list[str], tolerance: float) -> Any:
    """Tasks of poses, weighted alike, with its limits."""
    model = pin.buildModelFromUrdf(file)
    configuration = Configuration(model, model.createData(), pin.neutral(model))
    tasks = [FrameTask(name, 1.0, 1.0, lm_damping=LM) for name in frames]

    def aim(poses: Array) -> None:
        for task, pose in zip(tasks, poses, strict=True):
            task.set_target(pin.SE3(pose[:3, :3], pose[:3, 3]))

    def at(q: Array) -> float:
        configuration.update(q)
        return float(np.linalg.norm([task.compute_error(configuration) for task in tasks]))

    def step(q: Array) -> Array:
        v = solve_ik(configuration, tasks, PERIOD, _SOLVER, safety_break=False)
        return np.asarray(np.clip(q + v * PERIOD, model.lowerPositionLimit,
                                  model.upperPositionLimit))

    return iterated(aim, at, step, tolerance)
