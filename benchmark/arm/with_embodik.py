"""embodiK: its solver of velocities, with priorities and limits."""

from __future__ import annotations

from typing import Any

import embodik
import numpy as np

from benchmark.arm.scene import Array, Scene


class Embodik:
    """`KinematicsSolver.solve_velocity` with the position above the posture, as by default."""

    package = "embodik"
    priorities = "strict, scaled to the limits"
    rows = "of its own kinds, hard"

    def __init__(self, scene: Scene, posture: bool) -> None:
        self.scene = scene
        self.robot = embodik.RobotModel(scene.file)
        self.robot.update_configuration(np.array(scene.start))
        self.solver = embodik.KinematicsSolver(self.robot)
        self.solver.dt = scene.period
        self.solver.enable_position_limits(False)
        self.position = self.solver.add_frame_task("position", scene.frame,
                                                   embodik.TaskType.FRAME_POSITION)
        self.position.priority = 0
        self.posture = self.solver.add_posture_task("posture") if posture else None
        if self.posture is not None:
            self.posture.priority = 1

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """See `Adapter`."""
        scene = self.scene
        self.robot.update_kinematics(q)
        p = np.asarray(self.robot.get_frame_pose(scene.frame).translation)  # the task lags a tick
        self.position.set_target_velocity(rate + scene.gain * (goal - p))
        if self.posture is not None:
            self.posture.set_target_velocity(scene.posture_gain * (np.array(scene.posture) - q))
        return self._solved(q)

    def _solved(self, q: Array) -> Array:
        found: Any = self.solver.solve_velocity(q)
        if found.status != embodik.SolverStatus.SUCCESS:
            raise ArithmeticError(str(found.status))
        return np.array(found.joint_velocities)
