"""The resolvers of this project, through their common interface."""

from dataclasses import replace
from typing import Any

import numpy as np

from benchmark.solve.interface import Answer, Array, Problem, Solver
from hierarchy.errors import HierarchyError
from hierarchy.problem import Hierarchy
from solvers import Resolution, Status, make
from solvers.qp import backends


class Ours(Solver):
    """A resolver by name, with its settings; warm where its answer has a memory."""

    warm = True
    package = "task-hierarchy"

    def __init__(self, resolver: str, **settings: Any) -> None:
        self.resolver = make(resolver, **settings)

    def refuses(self, problem: Problem) -> str:
        """Return what the resolver says of a problem that it cannot handle, or ""."""
        if self.resolver.strict and self.resolver.can_resolve("inequalities"):
            return ""
        try:
            self.resolver.solve(self.prepare(problem))
        except HierarchyError as refusal:
            return str(refusal)
        return ""

    def prepare(self, problem: Problem) -> Hierarchy:
        """Wrap the arrays."""
        return Hierarchy(problem.A, problem.lower, problem.upper, problem.sizes, problem.reference)

    def solve(self, prepared: Hierarchy) -> Resolution:
        """Solve without memory."""
        return self.resolver.solve(prepared)

    def solve_from(self, prepared: Hierarchy, before: Resolution) -> Resolution:
        """Solve with the memory of an earlier answer."""
        return self.resolver.solve(prepared, before.memory)

    def read(self, raw: Resolution) -> Answer:
        """Return x, and whether the status is SOLVED."""
        return Answer(raw.x, raw.status is Status.SOLVED, raw.iterations)


class Hqp(Ours):
    """`hqp` with other options of its backend than its own; in a process of its own."""

    def __init__(self, backend: str, **options: Any) -> None:
        backends.BACKENDS = {**backends.BACKENDS, backend: replace(
            backends.BACKENDS[backend], options=options)}
        super().__init__("hqp", backend=backend)


class Plain(Solver):
    """The recursion (5), (6), (14) with np.linalg.pinv, as one writes it in a minute."""

    package = "numpy"

    def refuses(self, problem: Problem) -> str:
        """Equalities only."""
        return "" if problem.is_equality else "equalities only"

    def solve(self, prepared: Problem) -> Array:
        """Solve level by level."""
        n, begin = len(prepared.reference), 0
        x, P = np.zeros(n), np.eye(n)
        for end in prepared.ends.tolist():
            J, b = prepared.A[begin:end], prepared.lower[begin:end]
            inverse = np.linalg.pinv(J @ P, rcond=1e-9)
            x, P, begin = x + inverse @ (b - J @ x), P - inverse @ (J @ P), end
        return np.asarray(x + P @ prepared.reference)

    def read(self, raw: Array) -> Answer:
        """Return x; there is no status."""
        return Answer(raw, solved=True)
