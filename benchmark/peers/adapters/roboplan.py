"""roboplan's OInK: tasks weighted in one quadratic program, or in levels; targets as in `pink`."""

from typing import Any

import numpy as np
from roboplan import core, optimal_ik

from benchmark.peers.scenes import Arm, Array


def arm(scene: Arm, posture: bool, levels: bool = False) -> tuple[Any, None]:
    """`Oink.solveIk` for displacements of one period; with levels the posture has priority 2.

    It then acts in the null space of all six rows of the frame, whatever their costs.
    """
    model = core.Scene("arm", core.loadUrdfSceneDescription(scene.file))
    oink = optimal_ik.Oink(model)
    model.setJointPositions(np.array(scene.start))
    target = core.CartesianConfiguration("base", scene.frame, np.asfortranarray(np.eye(4)))
    # Its costs weigh squares.
    position = optimal_ik.FrameTask(oink, model, target, optimal_ik.FrameTaskOptions(
        position_cost=1.0 if levels else scene.ratio**2, orientation_cost=0.0))
    tasks = [position]
    if posture:
        gain = optimal_ik.ConfigurationTaskOptions(
            task_gain=scene.posture_gain * scene.period, priority=1 + levels)
        tasks.append(optimal_ik.ConfigurationTask(oink, np.array(scene.posture),
                                                  np.ones(len(scene.start)), gain))
    limits = [optimal_ik.VelocityLimit(oink, scene.period, np.array(scene.limit))]

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        now = model.forwardKinematics(q, scene.frame)
        now[:3, 3] = scene.after(now[:3, 3], goal, rate)
        position.setTargetFrameTransform(now)
        step = np.zeros(len(q))
        oink.solveIk(q, tasks, limits, step)
        return step / scene.period

    return velocity, None
