"""DAQP's hierarchical mode."""

from typing import Any

import daqp
import numpy as np

from benchmark.solve.interface import Answer, Problem, Solver

_UNBOUNDED = 1e30  # how it writes a missing side


class Daqp(Solver):
    """`daqp.solve` with break points and settings; leading rows of the identity as bounds."""

    package = "daqp"

    def __init__(self, **settings: float) -> None:
        self.settings = settings

    def prepare(self, problem: Problem) -> tuple[Any, ...]:
        """Convert, with a unit Hessian for the distance to the reference."""
        n = len(problem.reference)
        leading = len(problem.sizes) and problem.sizes[0] == n
        bounds = n if leading and (problem.A[:n] == np.eye(n)).all() else 0
        return (np.eye(n), -problem.reference, np.ascontiguousarray(problem.A[bounds:]),
                np.minimum(problem.upper, _UNBOUNDED), np.maximum(problem.lower, -_UNBOUNDED),
                np.zeros(len(problem.A), dtype=np.int32), problem.ends.astype(np.int32))

    def solve(self, prepared: tuple[Any, ...]) -> Any:
        """Call it."""
        return daqp.solve(*prepared, **self.settings)

    def read(self, raw: Any) -> Answer:
        """Return x, which is uninitialised unless the exit flag is positive."""
        x, _, flag, info = raw
        return Answer(np.array(x) if flag > 0 else np.zeros(len(x)), flag > 0,
                      int(info["iterations"]))
