"""roboplan's OInK: weighted tasks in one quadratic program; targets as in `with_pink`."""

from __future__ import annotations

import numpy as np
from roboplan import core, optimal_ik

from benchmark.arm.scene import Array
from benchmark.arm.scene import Scene as Asked


class Oink:
    """`Oink.solveIk` for displacements of one period."""

    package = "roboplan"
    priorities = "weights"
    rows = "of its own kinds, hard"

    def __init__(self, scene: Asked, posture: bool) -> None:
        self.scene, self.still = scene, np.zeros(len(scene.start))
        self.model = core.Scene("arm", core.loadUrdfSceneDescription(scene.file))
        self.oink = optimal_ik.Oink(self.model)
        self.model.setJointPositions(np.array(scene.start))
        target = core.CartesianConfiguration("base", scene.frame, np.asfortranarray(np.eye(4)))
        # Its costs weigh squares.
        self.position = optimal_ik.FrameTask(
            self.oink, self.model, target,
            optimal_ik.FrameTaskOptions(position_cost=scene.ratio**2, orientation_cost=0.0))
        self.tasks = [self.position]
        if posture:
            gain = optimal_ik.ConfigurationTaskOptions(task_gain=scene.posture_gain * scene.period)
            self.tasks.append(optimal_ik.ConfigurationTask(
                self.oink, np.array(scene.posture), np.ones(len(scene.start)), gain))
        self.limits = [optimal_ik.VelocityLimit(self.oink, scene.period, np.array(scene.limit))]

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """See `Adapter`."""
        scene = self.scene
        now = self.model.forwardKinematics(q, scene.frame)
        now[:3, 3] += scene.period * (rate + scene.gain * (goal - now[:3, 3]))
        self.position.setTargetFrameTransform(now)
        step = np.zeros(len(q))
        self.oink.solveIk(q, self.tasks, self.limits, step)
        return step / scene.period
