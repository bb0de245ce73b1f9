"""pink: tasks weighted in one quadratic program, or as its constraints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import qpsolvers
from pink import Configuration, build_ik
from pink.exceptions import NoSolutionFound
from pink.limits import VelocityLimit
from pink.tasks import FrameTask, PostureTask

from benchmark.arm.scene import Array, Scene

_SOLVER = "daqp"


class Pink:
    """The two steps of `pink.solve_ik`.

    The end effector's target is its position after one period with its current rotation, which
    requests the scene's velocity and no rotation.
    """

    package = "pin-pink"
    priorities = "weights"
    rows = "any, hard"

    def __init__(self, scene: Scene, posture: bool, hard: bool = False) -> None:
        self.scene, model = scene, pin.buildModelFromUrdf(scene.file)
        self.configuration = Configuration(model, model.createData(), np.array(scene.start))
        kind = _PositionTask if hard else FrameTask
        self.position = kind(scene.frame, position_cost=scene.ratio, orientation_cost=0.0)
        tasks = [PostureTask(cost=1.0, gain=scene.posture_gain * scene.period)] if posture else []
        for task in tasks:
            task.set_target(np.array(scene.posture))
        self.tasks = tasks if hard else [self.position, *tasks]
        self.constraints = [self.position] if hard else None
        self.limits = [VelocityLimit(model, np.array(scene.limit))]

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """See `Adapter`."""
        scene, configuration = self.scene, self.configuration
        configuration.update(q)
        now = configuration.get_transform_frame_to_world(scene.frame)
        asked = rate + scene.gain * (goal - now.translation)
        self.position.set_target(pin.SE3(now.rotation, now.translation + scene.period * asked))
        configuration.check_limits(safety_break=True)
        self.problem = build_ik(configuration, self.tasks, scene.period, limits=self.limits,
                                constraints=self.constraints)
        found = self.resolve()
        if not found.found or found.x is None:
            raise NoSolutionFound(self.problem, found)
        return np.asarray(found.x / scene.period)

    def resolve(self) -> qpsolvers.Solution:
        """See `Adapter`."""
        return qpsolvers.solve_problem(self.problem, solver=_SOLVER)


class PinkHard(Pink):
    """The position as a constraint."""

    priorities = "one hard, then weights"

    def __init__(self, scene: Scene, posture: bool) -> None:
        super().__init__(scene, posture, hard=True)


class _PositionTask(FrameTask):  # type: ignore[misc]
    """Only the position rows of a frame: costs do not select rows of a constraint."""

    def compute_error(self, configuration: Configuration) -> Array:
        return np.asarray(super().compute_error(configuration)[:3])

    def compute_jacobian(self, configuration: Configuration) -> Array:
        return np.asarray(super().compute_jacobian(configuration)[:3])
