"""embodiK: its solver of velocities, with priorities and limits."""

from typing import Any

import embodik
import numpy as np

from benchmark.peers.scenes import Arm, Array


def arm(scene: Arm, posture: bool) -> tuple[Any, None]:
    """`KinematicsSolver.solve_velocity` with the position above the posture, as by default."""
    robot = embodik.RobotModel(scene.file)
    robot.update_configuration(np.array(scene.start))
    solver = embodik.KinematicsSolver(robot)
    solver.dt = scene.period
    solver.enable_position_limits(False)
    position = solver.add_frame_task("position", scene.frame, embodik.TaskType.FRAME_POSITION)
    position.priority = 0
    joints = solver.add_posture_task("posture") if posture else None
    if joints is not None:
        joints.priority = 1

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        robot.update_kinematics(q)
        p = np.asarray(robot.get_frame_pose(scene.frame).translation)  # the task lags a tick
        position.set_target_velocity(scene.wanted(p, goal, rate))
        if joints is not None:
            joints.set_target_velocity(scene.still(q))
        found: Any = solver.solve_velocity(q)
        if found.status != embodik.SolverStatus.SUCCESS:
            raise ArithmeticError(str(found.status))
        return np.array(found.joint_velocities)

    return velocity, None
