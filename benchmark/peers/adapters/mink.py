"""mink: like pink, with MuJoCo's kinematics."""

from functools import partial
from typing import Any

import mink
import mujoco
import numpy as np

from benchmark.peers.common import LM, PERIOD, SOLVER, of_program, of_tasks, position_only
from benchmark.peers.scenes import Arm, Array


def arm(scene: Arm, posture: bool, hard: bool = False) -> tuple[Any, Any]:
    """Targets are as in `pink`."""
    model = mujoco.MjModel.from_xml_path(scene.file)
    configuration = mink.Configuration(model, np.array(scene.start))
    kind = position_only(mink.FrameTask) if hard else mink.FrameTask
    position = kind(scene.frame, "body", position_cost=scene.ratio, orientation_cost=0.0)
    still = [mink.PostureTask(model, cost=1.0, gain=scene.posture_gain * scene.period)] * posture
    limits = [mink.VelocityLimit(model, dict(zip(scene.joints, scene.limit, strict=True)))]

    def aim(goal: Array, rate: Array) -> None:
        now = configuration.get_transform_frame_to_world(scene.frame, "body")
        position.set_target(mink.SE3.from_rotation_and_translation(
            now.rotation(), scene.after(now.translation(), goal, rate)))
        configuration.check_limits(safety_break=False)

    return of_program(scene, configuration, aim, partial(mink.build_ik, limits=limits), position,
                      still, hard)


def reach(file: str, frames: list[str], tolerance: float) -> Any:
    """Tasks of poses, weighted alike, with its limits."""
    model = mujoco.MjModel.from_xml_path(file)
    configuration = mink.Configuration(model)
    tasks = [mink.FrameTask(name, "body", 1.0, 1.0, lm_damping=LM) for name in frames]
    return of_tasks(configuration, tasks, tuple(model.jnt_range.T), mink.SE3.from_matrix,
                    lambda: mink.solve_ik(configuration, tasks, PERIOD, SOLVER), tolerance)
