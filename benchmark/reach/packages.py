"""Inverse kinematics to the end, by each package. Needs only numpy and the package."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmark.arm.scene import Array

MOST = 200           # iterations of each start
PERIOD = 0.1         # [s] of a step, of which the limits of speed allow one
_STILL = 1e-3        # relative decrease of the error within `_PATIENCE` iterations that goes on
_PATIENCE = 10
_LM = 1.0            # lm_damping of tasks in pink and mink, as in their examples

Poses = NDArray[np.float64]  # (frames, 4, 4)


class Iterated:
    """One package: steps until the error is small or does not fall, then from the next start."""

    def __init__(self, tolerance: float) -> None:
        self.tolerance = tolerance

    def aim(self, poses: Poses) -> None:
        """Take the targets."""
        raise NotImplementedError

    def at(self, q: Array) -> float:
        """Go to q and return the norm of the error there."""
        raise NotImplementedError

    def step(self, q: Array) -> Array:
        """Return the next q."""
        raise NotImplementedError

    def solve(self, poses: Poses, starts: Array) -> tuple[Array, bool]:
        """Return the best configuration, and whether it is within the tolerance."""
        self.aim(poses)
        best, nearest = np.inf, starts[0]
        for start in starts:
            q, errors = start.copy(), list[float]()
            for k in range(MOST):
                errors.append(self.at(q))
                if errors[-1] < best:
                    best, nearest = errors[-1], q.copy()
                if best <= self.tolerance:
                    return nearest, True
                if k >= _PATIENCE and min(errors[-_PATIENCE:]) > (
                        (1.0 - _STILL) * min(errors[:-_PATIENCE])):
                    break
                try:
                    q = self.step(q)
                except Exception:  # no solution of a step: the next start
                    break
        return nearest, False


class Tasks(Iterated):
    """Tasks of pink or mink, weighted alike, with a configuration and limits of positions."""

    configuration: Any
    tasks: list[Any]
    limits: tuple[Array, Array]

    def pose(self, matrix: Array) -> Any:
        """Return a pose (4, 4) as the package has it."""
        raise NotImplementedError

    def velocity(self) -> Array:
        """Return the velocity of a step."""
        raise NotImplementedError

    def aim(self, poses: Poses) -> None:
        """See `Iterated`."""
        for task, pose in zip(self.tasks, poses, strict=True):
            task.set_target(self.pose(pose))

    def at(self, q: Array) -> float:
        """See `Iterated`."""
        self.configuration.update(q)
        return float(np.linalg.norm([task.compute_error(self.configuration)
                                     for task in self.tasks]))

    def step(self, q: Array) -> Array:
        """See `Iterated`."""
        return np.asarray(np.clip(q + self.velocity() * PERIOD, *self.limits))


class Pink(Tasks):
    """pink, with its limits."""

    def __init__(self, file: str, frames: list[str], tolerance: float) -> None:
        import pink
        import pinocchio as pin

        super().__init__(tolerance)
        self.pink, self.pin, model = pink, pin, pin.buildModelFromUrdf(file)
        self.configuration = pink.Configuration(model, model.createData(), pin.neutral(model))
        self.tasks = [pink.tasks.FrameTask(name, 1.0, 1.0, lm_damping=_LM) for name in frames]
        self.limits = model.lowerPositionLimit, model.upperPositionLimit

    def pose(self, matrix: Array) -> Any:
        """See `Tasks`."""
        return self.pin.SE3(matrix[:3, :3], matrix[:3, 3])

    def velocity(self) -> Array:
        """See `Tasks`."""
        return np.asarray(self.pink.solve_ik(self.configuration, self.tasks, PERIOD, "daqp",
                                             safety_break=False))


class Mink(Tasks):
    """mink, with its limits."""

    def __init__(self, file: str, frames: list[str], tolerance: float) -> None:
        import mink
        import mujoco

        super().__init__(tolerance)
        self.mink, model = mink, mujoco.MjModel.from_xml_path(file)
        self.configuration = mink.Configuration(model)
        self.tasks = [mink.FrameTask(name, "body", 1.0, 1.0, lm_damping=_LM) for name in frames]
        self.limits = model.jnt_range[:, 0], model.jnt_range[:, 1]

    def pose(self, matrix: Array) -> Any:
        """See `Tasks`."""
        return self.mink.SE3.from_matrix(matrix)

    def velocity(self) -> Array:
        """See `Tasks`."""
        return np.asarray(self.mink.solve_ik(self.configuration, self.tasks, PERIOD, "daqp"))


class Placo(Iterated):
    """Tasks of placo, weighted alike, with its limits."""

    def __init__(self, file: str, frames: list[str], tolerance: float) -> None:
        import placo

        super().__init__(tolerance)
        self.frames = frames
        self.robot = placo.RobotWrapper(file, placo.Flags.ignore_collisions)
        self.solver = placo.KinematicsSolver(self.robot)
        self.solver.mask_fbase(True)
        self.solver.enable_velocity_limits(True)
        self.solver.dt = PERIOD
        self.tasks = [self.solver.add_frame_task(name, np.eye(4)) for name in frames]
        for task, name in zip(self.tasks, frames, strict=True):
            task.configure(name, "soft", 1.0, 1.0)
        self.solver.add_regularization_task(1e-6)

    def aim(self, poses: Poses) -> None:
        """See `Iterated`."""
        self.poses = poses
        for task, pose in zip(self.tasks, poses, strict=True):
            task.T_world_frame = pose

    def at(self, q: Array) -> float:
        """See `Iterated`."""
        self.robot.state.q[7:] = q
        self.robot.update_kinematics()
        return float(np.sqrt(sum(
            _apart(self.robot.get_T_world_frame(name), pose) ** 2
            for name, pose in zip(self.frames, self.poses, strict=True))))

    def step(self, q: Array) -> Array:
        """See `Iterated`."""
        self.solver.solve(True)
        return np.array(self.robot.state.q[7:])


class Ours:
    """`solve_ik` with `until`, with pose tasks of one level."""

    def __init__(self, file: str, frames: list[str], tolerance: float) -> None:
        from hierarchy import Robot

        self.robot, self.tolerance = Robot.from_file(file, shapes=False), tolerance
        self.frames = [self.robot.frame(name) for name in frames]

    def solve(self, poses: Poses, starts: Array) -> tuple[Array, bool]:
        """See `Iterated`."""
        from hierarchy.paths import Still
        from hierarchy.tasks import Pose, Together
        from solvers import solve_ik

        hands = [Pose(frame, Still(pose[:3, 3]), pose[:3, :3], name=frame.name)
                 for frame, pose in zip(self.frames, poses, strict=True)]
        found = solve_ik(self.robot, starts[0], [Together(hands, "hands")], until=self.tolerance)
        return found.q, found.met


def _apart(here: Array, there: Array) -> float:
    """Return the length of position [m] and rotation error [rad] together."""
    turn = there[:3, :3] @ here[:3, :3].T
    angle = np.arctan2(np.linalg.norm([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0],
                                       turn[1, 0] - turn[0, 1]]) / 2, (np.trace(turn) - 1.0) / 2)
    return float(np.hypot(np.linalg.norm(here[:3, 3] - there[:3, 3]), angle))
