"""The resolvers of this project, through their common interface."""

from dataclasses import replace
from typing import Any

import numpy as np

from benchmark.solve.interface import Answer, Solver
from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers import Resolution, Status, make
from solvers.qp import backends


class Ours(Solver):
    """A resolver by name, with its settings; warm where its answer has a memory."""

    warm = True
    package = "task-hierarchy"

    def __init__(self, resolver: str, **settings: Any) -> None:
        self.resolver = make(resolver, **settings)

    def refuses(self, problem: Hierarchy) -> str:
        """Return what the resolver says of a problem that it cannot handle, or ""."""
        if self.resolver.strict and self.resolver.can_resolve("inequalities"):
            return ""
        try:
            self.resolver.solve(problem)
        except HierarchyError as refusal:
            return str(refusal)
        return ""

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

    def refuses(self, problem: Hierarchy) -> str:
        """Equalities only."""
        return "" if problem.is_equality else "equalities only"

    def solve(self, prepared: Hierarchy) -> Array:
        """Solve level by level."""
        x, P = np.zeros(prepared.n), np.eye(prepared.n)
        for J, b, _ in prepared.levels():
            inverse = np.linalg.pinv(J @ P, rcond=1e-9)
            x, P = x + inverse @ (b - J @ x), P - inverse @ (J @ P)
        return np.asarray(x + P @ prepared.reference)

    def read(self, raw: Array) -> Answer:
        """Return x; there is no status."""
        return Answer(raw, solved=True)
