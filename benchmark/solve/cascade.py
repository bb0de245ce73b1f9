"""A cascade of quadratic programs through qpsolvers, as one writes it by hand.

One program for each level, in x and the violations w of its rows: minimise |w|^2, keep the rows
above within what they have reached. A last program finds the x nearest to the reference.
"""

from importlib.metadata import version
from typing import Any

import numpy as np
from qpsolvers import solve_qp

from benchmark.solve.interface import Answer, Solver
from hierarchy.problem import Array, Hierarchy

_TINY = 1e-9  # weight of |x - reference|^2 beside |w|^2, for solvers that need a definite Hessian


class Cascade(Solver):
    """One backend of qpsolvers with options of its own.

    slack : left to rows above when they are kept.
    """

    def __init__(self, backend: str, slack: float = 0.0, **options: Any) -> None:
        self.backend, self.slack, self.options = backend, slack, options

    def version(self) -> str:
        """Return that of qpsolvers and of the backend."""
        package = {"proxqp": "proxsuite", "highs": "highspy"}.get(self.backend, self.backend)
        return f"qpsolvers {version('qpsolvers')}, {package} {version(package)}"

    def solve(self, prepared: Hierarchy) -> tuple[Array, bool]:
        """Solve level by level; False from the first program without a solution."""
        x, n, end = prepared.reference, prepared.n, 0
        lower, upper = prepared.lower.copy(), prepared.upper.copy()
        for rows, low, high in prepared.levels():
            begin, m = end, len(low)
            end += m
            if not m:
                continue
            P = np.diag(np.concatenate([np.full(n, _TINY), np.ones(m)]))
            q = np.concatenate([-_TINY * prepared.reference, np.zeros(m)])
            A = np.zeros((end, n + m))
            A[:, :n] = prepared.A[:end]
            A[begin:, n:] = -np.eye(m)
            found = self._solve(P, q, A, lower[:end], upper[:end])
            if found is None:
                return x, False
            x = found[:n]
            reached = rows @ x  # what is equal or violated stays there; others keep their sides
            fixed = (low == high) | (reached > high) | (reached < low)
            lower[begin:end] = np.where(fixed, reached - self.slack, low)
            upper[begin:end] = np.where(fixed, reached + self.slack, high)
        found = self._solve(np.eye(n), -prepared.reference, prepared.A, lower, upper)
        return (x, False) if found is None else (found, True)

    def _solve(self, P: Array, q: Array, A: Array, lower: Array, upper: Array) -> Array | None:
        equal = lower == upper
        above, below = ~equal & (upper < np.inf), ~equal & (lower > -np.inf)
        G = np.vstack([A[above], -A[below]])
        h = np.concatenate([upper[above], -lower[below]])
        try:
            found = solve_qp(P, q, G if len(G) else None, h if len(G) else None,
                             A[equal] if equal.any() else None,
                             lower[equal] if equal.any() else None, solver=self.backend,
                             **self.options)
        except Exception:  # backends raise for what others call infeasible
            return None
        return None if found is None or not np.isfinite(found).all() else np.asarray(found)

    def read(self, raw: tuple[Array, bool]) -> Answer:
        """Return x, and whether every program had a solution."""
        return Answer(*raw)
