"""The resolvers of this project, through their common interface."""

from __future__ import annotations

from importlib.metadata import version
from typing import Any

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Hierarchy
from scenarios.bench.open.entrant import Answer, Entrant, Problem
from solvers import Resolution, Status, make


class Ours(Entrant):
    """A resolver by name, with its settings."""

    def __init__(self, resolver: str, **settings: Any) -> None:
        self.resolver = make(resolver, **settings)
        one = Hierarchy.from_levels([(np.eye(2), [1.0, 2.0])])
        self.warm = self.resolver.solve(one).memory is not None

    def version(self) -> str:
        """Return that of this project."""
        return f"task-hierarchy {version('task-hierarchy')}"

    def refuses(self, problem: Problem) -> str:
        """Return what the resolver says of rows that it cannot handle, or ""."""
        if self.resolver.can_resolve("inequalities"):
            return ""
        try:
            self.resolver.solve(self.prepare(problem))
        except HierarchyError as refusal:
            return str(refusal)
        return ""

    def prepare(self, problem: Problem) -> Hierarchy:
        """Wrap the arrays."""
        return Hierarchy(problem.A, problem.lower, problem.upper, problem.sizes,
                         problem.reference)

    def solve(self, prepared: Hierarchy) -> Resolution:
        """Solve without memory."""
        return self.resolver.solve(prepared)

    def solve_from(self, prepared: Hierarchy, before: Resolution) -> Resolution:
        """Solve with the memory of an earlier answer."""
        return self.resolver.solve(prepared, before.memory)

    def read(self, raw: Resolution) -> Answer:
        """Return x, and whether the status is SOLVED."""
        return Answer(raw.x, raw.status is Status.SOLVED, raw.iterations)
