"""One level as a quadratic program, in the two forms of `hqp`, and the call of a backend."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.linalg import norm
from numpy.typing import ArrayLike

from hierarchy.errors import OF_PROCESS, HierarchyError, expect, refuse, whole
from hierarchy.gate import array_of, sound_rows
from hierarchy.problem import Array, Hierarchy
from solvers.qp.backends import Backend
from solvers.qp.refinement import Rows, split

if TYPE_CHECKING:
    import qpsolvers
    from scipy.sparse import csc_matrix

_RANK, _SETTLED = 1e-8, 1e-7  # of `level_problem`: rank tolerance, and miss of a row that is kept
_FAR = 1e6  # sizes of y beyond which proxqp does not come back from a guess, in seconds


class Program(NamedTuple):
    """min y^T P y / 2 + q^T y with lower <= A y <= upper and F y = f; initial guess `start`."""

    P: Array
    q: Array
    A: Array
    lower: Array
    upper: Array
    F: Array
    f: Array
    start: Array | None = None

    def solve(self, backend: Backend, unit: float = 1.0) -> tuple[Array, bool]:
        """Return the backend's y, zeros if it gave none, and whether the backend vouches for it.

        unit : multiple of the size of y in which y is passed to a backend that is `scaled`.
        """
        program, size = self._scaled(unit if backend.scaled else 0.0)
        if backend.halved:
            program = program._replace(P=np.triu(program.P))
        y, found = program._answer(backend, backend.options)
        if not found and backend.insisting:
            y, found = program._answer(backend, {**backend.options, **backend.insisting})
        return size * y, found

    def _answer(self, backend: Backend, options: Mapping[str, Any]) -> tuple[Array, bool]:
        """Return what `solve` does, of this program as it is."""
        import qpsolvers

        with OF_PROCESS, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the backend's status says the same
            try:
                solution = qpsolvers.solve_problem(
                    self.problem(backend.sparse, backend.regularisation), solver=backend.name,
                    initvals=self.start if backend.starts else None, **options)
            except Exception:  # backends raise any exception; each is a failure
                return np.zeros(len(self.q)), False
        if solution.x is None or not np.isfinite(solution.x).all():
            return np.zeros(len(self.q)), False
        return np.asarray(solution.x), bool(solution.found)

    def _scaled(self, unit: float) -> tuple[Program, float]:
        """Return the program with a Hessian and an answer of order one, and what that counts.

        Backends took others for infeasible, which none is.
        """
        weight = float(self.P.diagonal().max(initial=0.0)) or 1.0
        size = unit * max(float(norm(self.q)) / weight, float(
            abs(np.clip(0.0, self.lower, self.upper)).max(initial=0.0))) or 1.0
        start = None
        if self.start is not None and norm(self.start) <= _FAR * size:
            start = self.start / size
        return Program(self.P / weight, self.q / (weight * size), self.A, self.lower / size,
                       self.upper / size, self.F, self.f / size, start), size

    def problem(self, sparse: bool = False, regularisation: float = 0.0) -> qpsolvers.Problem:
        """Return the `qpsolvers.Problem` P, q, G, h, F, f, with G y <= h for both sides.

        sparse : whether the matrices are sparse.
        regularisation : added to the diagonal of P.
        """
        import qpsolvers

        kind = _sparse if sparse else np.ascontiguousarray
        P = self.P + regularisation * np.eye(len(self.q)) if regularisation else self.P
        rows: dict[str, object] = {}
        if len(self.A):
            up, low = np.isfinite(self.upper), np.isfinite(self.lower)
            rows["G"] = kind(np.vstack([self.A[up], -self.A[low]]))
            rows["h"] = np.concatenate([self.upper[up], -self.lower[low]])
        if self.f.size:
            rows["A"], rows["b"] = kind(self.F), self.f
        return qpsolvers.Problem(kind(P), self.q, **rows)


def _sparse(M: Array) -> csc_matrix:
    """Return `csc_matrix(M)`, in half its time."""
    from scipy.sparse import csc_matrix

    columns, rows = np.nonzero(M.T)
    starts = np.zeros(M.shape[1] + 1, np.intc)
    np.cumsum(np.count_nonzero(M, axis=0), out=starts[1:])
    return csc_matrix((M[rows, columns], rows.astype(np.intc), starts), M.shape)


def null_space_program(goal: Rows, limits: Rows, kept: Rows, lam: float, start: Array | None,
                       held: Rows | None = None) -> Program:
    """Return the program with unknowns z and w (k,), the signed violation of each limit.

    held : equalities, whose `lower` counts; None for none.
    """
    p, k = goal.A.shape[1], limits.lower.size
    F, f, _ = Rows.none(p) if held is None else held
    P, A = np.eye(p + k), np.zeros((k + kept.lower.size, p + k))
    P[:p, :p] = goal.A.T @ goal.A + lam**2 * P[:p, :p]
    A[:k, :p], A[:k, p:], A[k:, :p] = limits.A, -P[p:, p:], kept.A
    begin = None if start is None else np.concatenate([start, limits.excess(start)])
    return Program(P, np.concatenate([-goal.A.T @ goal.lower, np.zeros(k)]), A,
                   np.concatenate([limits.lower, kept.lower]),
                   np.concatenate([limits.upper, kept.upper]),
                   np.hstack([F, np.zeros((len(F), k))]), f, begin)


def slack_program(goal: Rows, limits: Rows, kept: Rows, held: Rows, lam: float,
                  start: Array | None = None) -> Program:
    """Return the program with unknowns d (n,), the step, and w, the violation of each row.

    It is that of the goal lam d, w_g = 0, w_g being what each row of the given one misses.
    """
    (m, n), none = goal.A.shape, np.zeros(len(goal.A))
    limits, kept, held = (Rows(np.hstack([rows.A, np.zeros((len(rows.A), m))]), *rows[1:])
                          for rows in (limits, kept, held))
    missed = Rows(np.hstack([goal.A, -np.eye(m)]), goal.lower, goal.upper)
    if start is not None:
        start = np.concatenate([start, goal.A @ start - goal.lower])
    weights = Rows(np.diag([*[lam] * n, *none + 1.0]), *[np.zeros(n + m)] * 2)
    return null_space_program(weights, limits, kept, 0.0, start, missed.and_(held))


def level_problem(h: Hierarchy, level: int, above: ArrayLike | None = None, *,
                  sparse: bool = False) -> qpsolvers.Problem:
    """Return one level of a hierarchy as a `qpsolvers.Problem`, given an optimum of those above.

    The unknowns are x (n,), then w, the miss of each row of the level: equalities first, then
    inequalities. The objective is ||w||^2 / 2. Constraints hold the rows above: equalities, and
    inequalities that `above` violates, at their value there; the others within their sides. So
    `above` itself is always feasible. P is singular in x, which not every backend accepts.

    level : index of the level, 0 the most important; `len(h.sizes)` for the last step, which finds
        the x nearest to `h.reference` and has no w.
    above : (n,) an optimum of the levels above, None for level 0.
    sparse : whether the matrices are sparse, as some backends require.

    Raises HierarchyError: no such level; `above` missing, of a wrong shape or not finite; a metric
    or levels that give; rows that are not finite, or whose sides cross.
    """
    expect("level_problem: h", h, Hierarchy, "make one with Hierarchy.from_levels")
    h.refuse_extras("the hierarchy", "level_problem")
    refuse(not sound_rows(*h.rows[:3]), "level_problem: rows are not finite or sides cross")
    if whole("level_problem: level", level) > len(h.sizes):
        raise HierarchyError(f"level {level}: the hierarchy has levels 0 to {len(h.sizes) - 1}, "
                             f"and {len(h.sizes)} for its reference")
    x = np.zeros(h.n) if above is None and level == 0 else array_of(
        "above", () if above is None else above)
    if x.shape != (h.n,) or not np.isfinite(x).all():
        raise HierarchyError(f"level {level}: above must be the x ({h.n},) of the levels above, "
                             f"finite, got {above!r}")
    m = int(h.offsets[level])
    kept, held = _above(Rows(h.A[:m], h.lower[:m], h.upper[:m]), x)
    if level == len(h.sizes):
        goal = Rows(np.eye(h.n), h.reference, h.reference)
        return null_space_program(goal, Rows.none(h.n), kept, 0.0, None, held).problem(sparse)
    rows = Rows(*list(h.levels())[level])
    equal = rows.lower == rows.upper
    return slack_program(rows.where(equal), rows.where(~equal), kept, held, 0.0).problem(sparse)


def _above(rows: Rows, x: Array) -> tuple[Rows, Rows]:
    """Return the rows above that remain inequalities, and a basis of those fixed, at x."""
    value = rows.A @ x
    fixed = (rows.lower == rows.upper) | (abs(rows.excess(x)) > _SETTLED * (1.0 + abs(value)))
    F = split(rows.A[fixed], np.linalg.norm(rows.A[fixed], axis=1), _RANK)[0].T
    kept = rows.where(~fixed)
    return Rows(kept.A, np.minimum(kept.lower, value[~fixed]),
                np.maximum(kept.upper, value[~fixed])), Rows(F, F @ x, F @ x)
