"""mink: like pink, with MuJoCo's kinematics."""

from __future__ import annotations

import mink
import mujoco
import numpy as np
import qpsolvers

from benchmark.arm.scene import Array, Scene

_SOLVER = "daqp"


class Mink:
    """The two steps of `mink.solve_ik`; targets as in `with_pink`."""

    package = "mink"
    priorities = "weights"
    rows = "any, hard"

    def __init__(self, scene: Scene, posture: bool, hard: bool = False) -> None:
        self.scene, model = scene, mujoco.MjModel.from_xml_path(scene.file)
        self.configuration = mink.Configuration(model, np.array(scene.start))
        kind = _PositionTask if hard else mink.FrameTask
        self.position = kind(scene.frame, "body", position_cost=scene.ratio, orientation_cost=0.0)
        tasks = ([mink.PostureTask(model, cost=1.0, gain=scene.posture_gain * scene.period)]
                 if posture else [])
        for task in tasks:
            task.set_target(np.array(scene.posture))
        self.tasks = tasks if hard else [self.position, *tasks]
        self.constraints = [self.position] if hard else None
        self.limits = [mink.VelocityLimit(model, dict(zip(scene.joints, scene.limit,
                                                          strict=True)))]

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """See `Adapter`."""
        scene, configuration = self.scene, self.configuration
        configuration.update(q)
        now = configuration.get_transform_frame_to_world(scene.frame, "body")
        p = now.translation()
        asked = rate + scene.gain * (goal - p)
        self.position.set_target(mink.SE3.from_rotation_and_translation(
            now.rotation(), p + scene.period * asked))
        configuration.check_limits(safety_break=False)
        self.problem = mink.build_ik(configuration, self.tasks, scene.period, limits=self.limits,
                                     constraints=self.constraints)
        found = self.resolve()
        if not found.found or found.x is None:
            raise mink.NoSolutionFound(_SOLVER)
        return np.asarray(found.x / scene.period)

    def resolve(self) -> qpsolvers.Solution:
        """See `Adapter`."""
        return qpsolvers.solve_problem(self.problem, solver=_SOLVER)


class MinkHard(Mink):
    """The position as a constraint."""

    priorities = "one hard, then weights"

    def __init__(self, scene: Scene, posture: bool) -> None:
        super().__init__(scene, posture, hard=True)


class _PositionTask(mink.FrameTask):  # type: ignore[misc]
    """Only the position rows of a frame: costs do not select rows of a constraint."""

    def compute_error(self, configuration: mink.Configuration) -> Array:
        return np.asarray(super().compute_error(configuration)[:3])

    def compute_jacobian(self, configuration: mink.Configuration) -> Array:
        return np.asarray(super().compute_jacobian(configuration)[:3])
