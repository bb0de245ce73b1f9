"""One level as a quadratic program, in the two forms of `hqp`, and the call of a backend."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, final

import numpy as np

from hierarchy.problem import Array
from solvers.backends import Backend
from solvers.refinement import Rows


@final
@dataclass(frozen=True)
class Program:
    """min y^T P y / 2 + q^T y with lower <= A y <= upper and F y = f, begun from y = start."""

    P: Array
    q: Array
    A: Array
    lower: Array
    upper: Array
    F: Array
    f: Array
    start: Array | None = None

    def solve(self, backend: Backend) -> tuple[Array, bool]:
        """Return the backend's y, and whether it vouches for it; zeros where it gave none."""
        import qpsolvers

        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # backends warn of what their status says anyway
            try:
                solution = qpsolvers.solve_problem(
                    qpsolvers.Problem(*self._matrices(backend)), solver=backend.name,
                    initvals=self.start if backend.starts else None, **backend.options)
            except Exception:  # backends raise whatever they like; all of it is their failure
                return np.zeros(len(self.q)), False
        if solution.x is None or not np.isfinite(solution.x).all():
            return np.zeros(len(self.q)), False
        return np.asarray(solution.x), bool(solution.found)

    def _matrices(self, backend: Backend) -> tuple[Any, ...]:
        """Return P, q, G, h, F, f as the backend wants them, with G y <= h for both sides."""
        from scipy.sparse import csc_matrix  # type: ignore[import-untyped]

        kind = csc_matrix if backend.sparse else np.ascontiguousarray
        up, low = np.isfinite(self.upper), np.isfinite(self.lower)
        P = self.P + backend.regularisation * np.eye(len(self.q))
        rows: tuple[Any, Any] = (None, None)
        if len(self.A):
            rows = (kind(np.vstack([self.A[up], -self.A[low]])),
                    np.concatenate([self.upper[up], -self.lower[low]]))
        fixed = (kind(self.F), self.f) if self.f.size else (None, None)
        return kind(P), self.q, *rows, *fixed


def null_space_program(goal: Rows, limits: Rows, kept: Rows, lam: float,
                        start: Array | None) -> Program:
    """Unknowns: z, and w (k,) the signed violation of each limit."""
    p, k = goal.A.shape[1], limits.lower.size
    P = np.eye(p + k)
    P[:p, :p] = goal.A.T @ goal.A + lam**2 * np.eye(p)
    A = np.block([[limits.A, -np.eye(k)], [kept.A, np.zeros((kept.lower.size, k))]])
    begin = None if start is None else np.concatenate([start, limits.excess(start)])
    return Program(P, np.concatenate([-goal.A.T @ goal.lower, np.zeros(k)]), A,
                   np.concatenate([limits.lower, kept.lower]),
                   np.concatenate([limits.upper, kept.upper]),
                   np.empty((0, p + k)), np.empty(0), begin)


def slack_program(goal: Rows, limits: Rows, kept: Rows, F: Array, lam: float, last: bool,
                   start: Array | None) -> Program:
    """Unknowns: the step d (n,), and w (k,) what each goal and limit is missed by; F d = 0.

    The last program, where `goal` is d itself, is written without w.
    """
    n, m, k = goal.A.shape[1], 0 if last else goal.lower.size, limits.lower.size
    P = np.eye(n + m + k)
    P[:n, :n] *= 1.0 if last else lam**2
    q = np.zeros(n + m + k)
    q[:n] = -goal.lower if last else 0.0
    kept_rows = np.hstack([kept.A, np.zeros((kept.lower.size, m + k))])
    limit_rows = np.hstack([limits.A, np.zeros((k, m)), -np.eye(k)])
    goal_rows = np.hstack([goal.A[:m], -np.eye(m), np.zeros((m, k))])
    settled = np.hstack([F, np.zeros((len(F), m + k))])
    begin = None if start is None else np.concatenate(
        [start, (goal.A @ start - goal.lower)[:m], limits.excess(start)])
    return Program(P, q, np.vstack([limit_rows, kept_rows]),
                   np.concatenate([limits.lower, kept.lower]),
                   np.concatenate([limits.upper, kept.upper]),
                   np.vstack([goal_rows, settled]),
                   np.concatenate([goal.lower[:m], np.zeros(len(F))]), begin)
