"""embodiK: its solver of velocities, with priorities and limits, for a whole tick and as a solver.

Limits are rows of their own, then come levels of equalities.
"""

import itertools
from typing import Any

import embodik
import numpy as np

from benchmark.peers.scenes import Arm, Array
from benchmark.solve.interface import Answer, Solver, shifted
from hierarchy.problem import Hierarchy

_UNBOUNDED = 1e10  # how it writes a missing side


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


class Embodik(Solver):
    """`computeMultiObjectiveVelocitySolutionEigen`, with its defaults or with refinement."""

    package = "embodik"

    def __init__(self, refine: bool = False) -> None:
        self.refine = refine

    def refuses(self, problem: Hierarchy) -> str:
        """Inequalities belong in the first level."""
        equal = problem.lower == problem.upper
        first = int(problem.sizes[0]) if len(problem.sizes) else 0
        if not equal[first:].all():
            return "inequalities in the first level only"
        return "" if (problem.m > first or not equal.all()) else "no task"

    def prepare(self, problem: Hierarchy) -> tuple[Array, tuple[Any, ...]]:
        """Split limits and tasks, of x - reference; a first level of equalities is a task."""
        reference, problem = problem.reference, shifted(problem)
        n, first = problem.n, int(problem.sizes[0])
        limits = 0 if (problem.lower[:first] == problem.upper[:first]).all() else first
        levels = [slice(begin, end) for begin, end in itertools.pairwise(problem.offsets)
                  if end > begin >= limits]
        C = problem.A[:limits] if limits else np.eye(n)
        lower = problem.lower[:limits] if limits else np.full(n, -_UNBOUNDED)
        upper = problem.upper[:limits] if limits else np.full(n, _UNBOUNDED)
        return reference, (
            [problem.lower[rows].copy() for rows in levels],
            [np.asfortranarray(problem.A[rows]) for rows in levels], np.asfortranarray(C),
            np.maximum(lower, -_UNBOUNDED), np.minimum(upper, _UNBOUNDED))

    def solve(self, prepared: tuple[Array, tuple[Any, ...]]) -> tuple[Array, Any]:
        """Call it."""
        return prepared[0], embodik.computeMultiObjectiveVelocitySolutionEigen(
            *prepared[1], refine_partial_scale=self.refine)

    def read(self, raw: tuple[Array, Any]) -> Answer:
        """Return the solution, which is empty without one, and whether the status is SUCCESS."""
        reference, found = raw
        step = np.array(found.solution, dtype=float)
        return Answer(step + reference if len(step) else reference,
                      found.status == embodik.SolverStatus.SUCCESS)
