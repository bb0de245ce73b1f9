"""pink: tasks weighted in one quadratic program, or the position as its constraint."""

from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
from pink import Configuration, build_ik, solve_ik
from pink.limits import VelocityLimit
from pink.tasks import FrameTask, PostureTask

from benchmark.peers.common import LM, PERIOD, SOLVER, of_program, of_tasks, position_only
from benchmark.peers.scenes import Arm, Array


def arm(scene: Arm, posture: bool, hard: bool = False) -> tuple[Any, Any]:
    """The end effector's target is its position after one period with its current rotation.

    That requests the scene's velocity and no rotation.
    """
    model = pin.buildModelFromUrdf(scene.file)
    configuration = Configuration(model, model.createData(), np.array(scene.start))
    kind = position_only(FrameTask) if hard else FrameTask
    position = kind(scene.frame, position_cost=scene.ratio, orientation_cost=0.0)
    still = [PostureTask(cost=1.0, gain=scene.posture_gain * scene.period)] * posture
    limits = [VelocityLimit(model, np.array(scene.limit))]

    def aim(goal: Array, rate: Array) -> None:
        now = configuration.get_transform_frame_to_world(scene.frame)
        position.set_target(pin.SE3(now.rotation, scene.after(now.translation, goal, rate)))
        configuration.check_limits(safety_break=True)

    return of_program(scene, configuration, aim, partial(build_ik, limits=limits), position, still,
                      hard)


def reach(file: str, frames: list[str], tolerance: float) -> Any:
    """Tasks of poses, weighted alike, with its limits."""
    model = pin.buildModelFromUrdf(file)
    configuration = Configuration(model, model.createData(), pin.neutral(model))
    tasks = [FrameTask(name, 1.0, 1.0, lm_damping=LM) for name in frames]
    return of_tasks(
        configuration, tasks, (model.lowerPositionLimit, model.upperPositionLimit),
        lambda pose: pin.SE3(pose[:3, :3], pose[:3, 3]),
        lambda: solve_ik(configuration, tasks, PERIOD, SOLVER, safety_break=False), tolerance)
