"""A template: plain damped least squares on all rows as equalities, which ignores priorities.

Copy this file, put your solver in, and check it:

    hierarchy bench open --check my_solver.py:Mine
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmark.solve.interface import Answer, Array, Problem, Solver


class Template(Solver):
    """One instance solves all problems of a file, one after the other."""

    def __init__(self, damping: float = 1e-6) -> None:
        self.damping = damping  # settings are arguments, so that the table can have variants

    def version(self) -> str:
        """Return name and version of the package."""
        return f"numpy {np.__version__}"

    def refuses(self, problem: Problem) -> str:
        """Return why a problem is not of the class that the solver can be asked, or ""."""
        return "" if problem.is_equality else "equalities only"

    def prepare(self, problem: Problem) -> Any:
        """Convert; not timed."""
        return problem.A, problem.lower

    def solve(self, prepared: tuple[Array, Array]) -> Array:
        """Solve; timed."""
        A, b = prepared
        H = A.T @ A + self.damping**2 * np.eye(A.shape[1])
        return np.asarray(np.linalg.solve(H, A.T @ b))

    def read(self, raw: Array) -> Answer:
        """Say what came out; not timed. `solved` is what the solver itself claims."""
        return Answer(raw, solved=True)
