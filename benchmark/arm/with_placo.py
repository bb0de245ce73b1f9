"""placo: tasks weighted, hard, or hard but scaled, in one quadratic program built in C++."""

from __future__ import annotations

from typing import Literal

import numpy as np
import placo

from benchmark.arm.scene import Array, Scene

_REGULARISED = 1e-12  # as in pink and mink
_BASE = 7             # coordinates of the fixed base


class Placo:
    """A position task and a joints task; targets are those after one period."""

    package = "placo"
    priorities = "weights"
    rows = "of its own kinds, hard or soft"

    def __init__(self, scene: Scene, posture: bool,
                 priority: Literal["soft", "hard", "scaled"] = "soft") -> None:
        self.scene = scene
        self.robot = robot = placo.RobotWrapper(scene.file, placo.Flags.ignore_collisions)
        self.solver = solver = placo.KinematicsSolver(robot)
        solver.mask_fbase(True)
        solver.enable_joint_limits(False)
        solver.enable_velocity_limits(True)
        solver.dt = scene.period
        for name, limit in zip(scene.joints, scene.limit, strict=True):
            robot.set_velocity_limit(name, limit)
        self.position = solver.add_position_task(scene.frame, np.zeros(3))
        self.position.configure("position", priority, scene.ratio**2)
        solver.add_regularization_task(_REGULARISED)
        self.joints, self.posture = None, np.array(scene.posture)
        if posture:
            self.joints = solver.add_joints_task()
            self.joints.configure("posture", "soft", 1.0)

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """See `Adapter`."""
        scene, robot = self.scene, self.robot
        robot.state.q[_BASE:] = q
        robot.update_kinematics()
        p = robot.get_T_world_frame(scene.frame)[:3, 3]
        self.position.target_world = p + scene.period * (rate + scene.gain * (goal - p))
        if self.joints is not None:
            wanted = q + scene.period * scene.posture_gain * (self.posture - q)
            self.joints.set_joints(dict(zip(scene.joints, wanted, strict=True)))
        return np.asarray(self.solver.solve(False)[-len(q):] / scene.period)


class PlacoHard(Placo):
    """The position as a constraint."""

    priorities = "one hard, then weights"

    def __init__(self, scene: Scene, posture: bool) -> None:
        super().__init__(scene, posture, "hard")


class PlacoScaled(Placo):
    """The position as a constraint whose target may be scaled down."""

    priorities = "one scaled, then weights"

    def __init__(self, scene: Scene, posture: bool) -> None:
        super().__init__(scene, posture, "scaled")
