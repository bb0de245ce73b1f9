"""mink: like pink, with MuJoCo's kinematics."""

from __future__ import annotations

from typing import Any

import mink
import mujoco
import numpy as np
import qpsolvers

from benchmark.peers.iterated import LM, PERIOD, iterated
from benchmark.peers.scenes import Arm, Array

_SOLVER = "daqp"


class _PositionTask(mink.FrameTask):  # type: ignore[misc]
    """Only the position rows of a frame: costs do not select rows of a constraint."""

    def compute_error(self, configuration: mink.Configuration) -> Array:
        return np.asarray(super().compute_error(configuration)[:3])

    def compute_jacobian(self, configuration: mink.Configuration) -> Array:
        return np.asarray(super().compute_jacobian(configuration)[:3])


def arm(scene: Arm, posture: bool, hard: bool = False) -> tuple[Any, Any]:
    """The two steps of `mink.solve_ik`; targets as in `pink`."""
    model = mujoco.MjModel.from_xml_path(scene.file)
    configuration = mink.Configuration(model, np.array(scene.start))
    position = (_PositionTask if hard else mink.FrameTask)(
        scene.frame, "body", position_cost=scene.ratio, orientation_cost=0.0)
    tasks = ([mink.PostureTask(model, cost=1.0, gain=scene.posture_gain * scene.period)]
             if posture else [])
    for task in tasks:
        task.set_target(np.array(scene.posture))
    limits = [mink.VelocityLimit(model, dict(zip(scene.joints, scene.limit, strict=True)))]
    problem: Any = None

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        nonlocal problem
        configuration.update(q)
        now = configuration.get_transform_frame_to_world(scene.frame, "body")
        p = now.translation()
        position.set_target(mink.SE3.from_rotation_and_translation(
            now.rotation(), p + scene.period * (rate + scene.gain * (goal - p))))
        configuration.check_limits(safety_break=False)
        problem = mink.build_ik(configuration, tasks if hard else [position, *tasks], scene.period,
                                limits=limits, constraints=[position] if hard else None)
        found = resolve()
        if not found.found or found.x is None:
            raise mink.NoSolutionFound(_SOLVER)
        return np.asarray(found.x / scene.period)

    def resolve() -> qpsolvers.Solution:
        return qpsolvers.solve_problem(problem, solver=_SOLVER)

    return velocity, resolve


def reach(file: str, frames: list[str], tolerance: float) -> Any:
    """Tasks of poses, weighted alike, with its limits."""
    model = mujoco.MjModel.from_xml_path(file)
    configuration = mink.Configuration(model)
    tasks = [mink.FrameTask(name, "body", 1.0, 1.0, lm_damping=LM) for name in frames]

    def aim(poses: Array) -> None:
        for task, pose in zip(tasks, poses, strict=True):
            task.set_target(mink.SE3.from_matrix(pose))

    def at(q: Array) -> float:
        configuration.update(q)
        return float(np.linalg.norm([task.compute_error(configuration) for task in tasks]))

    def step(q: Array) -> Array:
        v = mink.solve_ik(configuration, tasks, PERIOD, _SOLVER)
        return np.asarray(np.clip(q + v * PERIOD, *model.jnt_range.T))

    return iterated(aim, at, step, tolerance)
