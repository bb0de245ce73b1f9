"""embodiK's velocity solver: limits as rows of their own, then levels of equalities."""

import itertools
from typing import Any

import embodik
import numpy as np

from benchmark.solve.interface import Answer, Array, Problem, Solver

_UNBOUNDED = 1e10  # how it writes a missing side


class Embodik(Solver):
    """`computeMultiObjectiveVelocitySolutionEigen`, with its defaults or with refinement."""

    package = "embodik"

    def __init__(self, refine: bool = False) -> None:
        self.refine = refine

    def refuses(self, problem: Problem) -> str:
        """Inequalities belong in the first level."""
        equal = problem.lower == problem.upper
        first = int(problem.sizes[0]) if len(problem.sizes) else 0
        if not equal[first:].all():
            return "inequalities in the first level only"
        return "" if (len(problem.A) > first or not equal.all()) else "no task"

    def prepare(self, problem: Problem) -> tuple[Array, tuple[Any, ...]]:
        """Split limits and tasks, of x - reference; a first level of equalities is a task."""
        reference, problem = problem.reference, problem.shifted()
        n, first = len(problem.reference), int(problem.sizes[0])
        limits = 0 if (problem.lower[:first] == problem.upper[:first]).all() else first
        begins = np.concatenate([[0], problem.ends])
        levels = [slice(begin, end) for begin, end in itertools.pairwise(begins)
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
