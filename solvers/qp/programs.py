"""One level as a quadratic program, in the two forms of `hqp`; the call of a backend."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.qp.backends import Backend
from solvers.qp.refinement import Rows, split


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
                    self.problem(backend.sparse, backend.regularisation), solver=backend.name,
                    initvals=self.start if backend.starts else None, **backend.options)
            except Exception:  # backends raise whatever they like; all of it is their failure
                return np.zeros(len(self.q)), False
        if solution.x is None or not np.isfinite(solution.x).all():
            return np.zeros(len(self.q)), False
        return np.asarray(solution.x), bool(solution.found)

    def problem(self, sparse: bool = False, regularisation: float = 0.0) -> Any:
        """Return the `qpsolvers.Problem` P, q, G, h, F, f, with G y <= h for both sides.

        sparse : whether its matrices are; regularisation is added to the diagonal of P.
        """
        import qpsolvers
        from scipy.sparse import csc_matrix  # type: ignore[import-untyped]

        kind = csc_matrix if sparse else np.ascontiguousarray
        up, low = np.isfinite(self.upper), np.isfinite(self.lower)
        P = self.P + regularisation * np.eye(len(self.q))
        rows: tuple[Any, Any] = (None, None)
        if len(self.A):
            rows = (kind(np.vstack([self.A[up], -self.A[low]])),
                    np.concatenate([self.upper[up], -self.lower[low]]))
        fixed = (kind(self.F), self.f) if self.f.size else (None, None)
        return qpsolvers.Problem(kind(P), self.q, *rows, *fixed)


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
                   start: Array | None, f: Array | None = None) -> Program:
    """Unknowns: the step d (n,), and w (k,) what each goal and limit is missed by; F d = f.

    f is zero if None. The last program, where `goal` is d itself, is written without w.
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
                   np.concatenate([goal.lower[:m], np.zeros(len(F)) if f is None else f]), begin)


def level_problem(h: Hierarchy, level: int, above: ArrayLike | None = None,
                  rank_tolerance: float = 1e-9, settled: float = 1e-7, sparse: bool = False
                  ) -> Any:
    """Return one level of a hierarchy as a `qpsolvers.Problem`, given what the levels above reach.

    Its unknowns are x (n,), then w, what each row of the level is missed by: equalities first, then
    inequalities. Minimised is ||w||^2 / 2. Rows above hold by constraints: equalities, and
    inequalities that `above` breaks, at the value they have there; the others within their sides.
    So `above` itself is always feasible. P is singular in x: not every backend takes that.

    Parameters
    ----------
    level : index of the level, 0 the most important; `len(h.sizes)` for the last step, which takes
        the x nearest to `h.reference` and has no w.
    above : (n,) an optimum of the levels above, None for level 0.
    rank_tolerance : as in `Resolver`.
    settled : a row that `above` breaks by more, relative to 1 + |A x|, keeps its value.
    sparse : whether matrices are, which some backends ask for.

    Raises
    ------
    HierarchyError : no such level; `above` missing, of a wrong shape or not finite.
    """
    if not 0 <= level <= len(h.sizes):
        raise HierarchyError(f"level {level}: the hierarchy has levels 0 to {len(h.sizes) - 1}, "
                             f"and {len(h.sizes)} for its reference")
    x = np.zeros(h.n) if above is None and level == 0 else np.asarray(above, dtype=float)
    if x.shape != (h.n,) or not np.isfinite(x).all():
        raise HierarchyError(f"level {level}: above must be the x ({h.n},) of the levels above, "
                             f"finite, got {above!r}")
    m = int(h.offsets[level])
    done, value = Rows(h.A[:m], h.lower[:m], h.upper[:m]), h.A[:m] @ x
    fixed = (done.lower == done.upper) | (abs(done.excess(x)) > settled * (1.0 + abs(value)))
    norms = np.linalg.norm(done.A[fixed], axis=1)
    F = split(done.A[fixed], norms, rank_tolerance)[0].T
    kept = done.where(~fixed)
    kept = Rows(kept.A, np.minimum(kept.lower, value[~fixed]),
                np.maximum(kept.upper, value[~fixed]))
    if level == len(h.sizes):
        goal = Rows(np.eye(h.n), h.reference, h.reference)
        return slack_program(goal, Rows.none(h.n), kept, F, 0.0, True, None, F @ x).problem(sparse)
    own = slice(m, int(h.offsets[level + 1]))
    rows = Rows(h.A[own], h.lower[own], h.upper[own])
    equal = rows.lower == rows.upper
    return slack_program(rows.where(equal), rows.where(~equal), kept, F, 0.0, False, None,
                         F @ x).problem(sparse)
