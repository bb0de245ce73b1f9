"""A cascade of quadratic programs, one a level, through any backend that qpsolvers knows."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, final

import numpy as np
from numpy.linalg import norm

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.refinement import Rows, refined, split
from solvers.resolver import Resolution, Resolver, Status, register


@final
@dataclass(frozen=True)
class Backend:
    """How qpsolvers is to call a backend, and the error of x to expect from it (see `accuracy`)."""

    accuracy: float
    options: MappingProxyType[str, Any]
    sparse: bool = False
    regularisation: float = 0.0  # added to the diagonal where the Hessian has to be definite


BACKENDS = {
    "proxqp": Backend(1e-6, MappingProxyType({"eps_abs": 1e-9, "eps_rel": 0.0, "max_iter": 1000})),
    "osqp": Backend(1e-5, MappingProxyType({"eps_abs": 1e-7, "eps_rel": 1e-7, "max_iter": 20000}),
                    sparse=True),
}
OTHER = Backend(1e-5, MappingProxyType({}), regularisation=1e-9)


@final
@register
@dataclass(frozen=True, kw_only=True)
class Hqp(Resolver):
    """Quadratic programs from the top level down, equalities and inequalities.

    With x so far and N a basis of the null space of the rows that upper levels have fixed, a level
    looks for x + N z. Fixed are equalities, and inequalities that had to be violated. The other
    inequalities above stay as constraints, relaxed by `slack` so that rounding cannot make them
    infeasible. From the backend's answer the active set is read off and solved exactly; where that
    passes the optimality conditions it replaces the backend's answer, even one that the backend did
    not vouch for, and the slack leaves no trace.

    A level of equalities with no inequality above it is plain least squares, and one whose
    inequalities hold already needs nothing: neither calls the backend. `iterations` counts the
    programs that were solved.

    backend : any solver that qpsolvers finds installed.
    slack : relaxation of the inequalities above, in the unit of the rows.
    violated : an inequality violated by more than this, in the unit of the rows, is fixed.
    """

    backend: str = "proxqp"
    slack: float = 1e-7
    violated: float = 1e-6

    name: ClassVar[str] = "hqp"
    handles_inequalities: ClassVar[bool] = True

    def __post_init__(self) -> None:
        super().__post_init__()
        self._number("slack", 0.0, 1.0)
        self._number("violated", 0.0, 1.0)
        from qpsolvers import available_solvers  # costs 0.3 s: only where it is used

        if self.backend not in available_solvers:
            raise HierarchyError(f"hqp: backend {self.backend!r} is not installed; installed: "
                                 f"{', '.join(sorted(available_solvers))}")

    @property
    def label(self) -> str:
        """`hqp` and the backend."""
        return f"{self.name} {self.backend}"

    @property
    def accuracy(self) -> float:
        """Error of x to expect, relative to 1 + |x|: the backend's."""
        return BACKENDS.get(self.backend, OTHER).accuracy

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h; a failed program ends it with the x of the levels that were finished."""
        finite = np.isfinite(h.A).all() and np.isfinite(h.reference).all()
        sides = (h.lower <= h.upper) & (h.lower < np.inf) & (h.upper > -np.inf)
        if not finite or not sides.all():
            return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)
        return _Cascade(self, h).run()


@dataclass
class _Cascade:
    """One run of the cascade: x so far, the freedom N left, the inequalities to keep."""

    settings: Hqp
    h: Hierarchy
    programs: int = 0
    x: Array = field(init=False)
    N: Array = field(init=False)
    kept: Rows = field(init=False)

    def __post_init__(self) -> None:
        n = self.h.n
        self.x, self.N = np.zeros(n), np.eye(n)
        self.kept = Rows(np.empty((0, n)), np.empty(0), np.empty(0))

    def run(self) -> Resolution:
        for A, lower, upper in self.h.levels():
            if not self._level(Rows(A, lower, upper)):
                return Resolution(self.x, Status.BACKEND_FAILURE, self.programs)
        target = self.N.T @ (self.h.reference - self.x)
        nothing = Rows(np.empty((0, target.size)), np.empty(0), np.empty(0))
        z = self._minimise(np.eye(target.size), target, nothing)
        if z is None:
            return Resolution(self.x, Status.BACKEND_FAILURE, self.programs)
        return Resolution(self.x + self.N @ z, Status.SOLVED, self.programs)

    def _level(self, rows: Rows) -> bool:
        if not self.N.shape[1]:
            return True
        M, equal = rows.A @ self.N, rows.lower == rows.upper
        norms = norm(rows.A, axis=1)
        goal = rows.where(equal).seen(self.N, self.x)
        limits = rows.where(~equal).seen(self.N, self.x)
        lam = self._variable_damping(M, norms)
        own, _ = split(goal.A, norms[equal], self.settings.rank_tolerance)
        if not equal.any() and not limits.excess(np.zeros(M.shape[1])).any():
            z: Array | None = np.zeros(M.shape[1])
        elif equal.all() and not self.kept.lower.size:
            damped = np.vstack([goal.A @ own, lam * np.eye(own.shape[1])])
            missing = np.concatenate([goal.lower, np.zeros(own.shape[1])])
            z = own @ np.linalg.lstsq(damped, missing, rcond=None)[0]
        else:
            cost = np.vstack([goal.A, lam * np.eye(M.shape[1])]) if lam else goal.A
            z = self._minimise(cost, np.pad(goal.lower, (0, len(cost) - len(goal.lower))), limits)
        if z is None:
            return False
        self.x = self.x + self.N @ z
        excess = rows.excess(self.x)
        fixed = equal | (abs(excess) > self.settings.violated)
        _, free = split(M[fixed], norms[fixed], self.settings.rank_tolerance)
        self.N = self.N @ free
        self.kept = self.kept.and_(rows.where(~fixed))
        return True

    def _variable_damping(self, M: Array, norms: Array) -> float:
        s = self.settings
        if not s.damping or not M.shape[0]:
            return 0.0
        rank = split(M, norms, s.rank_tolerance)[0].shape[1]
        smallest = np.linalg.svd(M, compute_uv=False)[-1] if rank == M.shape[0] else 0.0
        return float(s.damping * np.sqrt(max(0.0, 1.0 - (smallest / s.threshold) ** 2)))

    def _minimise(self, E: Array, e: Array, limits: Rows) -> Array | None:
        """Minimise ||E z - e||^2 + ||excess of limits||^2 over the z that the kept rows allow."""
        if not E.shape[1]:
            return np.zeros(0)
        kept = self.kept.seen(self.N, self.x)
        if not kept.lower.size and not limits.lower.size:
            return np.asarray(np.linalg.lstsq(E, e, rcond=None)[0])
        z, found = self._program(E, e, limits, kept.relaxed(self.settings.slack))
        for start in (z, np.zeros_like(z)):  # zero keeps all of `kept`: x does
            exact = refined(start, E, e, limits, kept)
            if exact is not None:
                return exact
        return z if found else None

    def _program(self, E: Array, e: Array, limits: Rows, kept: Rows) -> tuple[Array, bool]:
        """Ask the backend, for z and the signed violation w of the limits together."""
        backend = BACKENDS.get(self.settings.backend, OTHER)
        p, k = E.shape[1], limits.lower.size
        P = np.zeros((p + k, p + k))
        P[:p, :p], P[p:, p:] = E.T @ E, np.eye(k)
        P[range(p), range(p)] += backend.regularisation
        A = np.block([[limits.A, -np.eye(k)], [kept.A, np.zeros((kept.lower.size, k))]])
        lower = np.concatenate([limits.lower, kept.lower])
        upper = np.concatenate([limits.upper, kept.upper])
        G = np.vstack([A[np.isfinite(upper)], -A[np.isfinite(lower)]])
        h = np.concatenate([upper[np.isfinite(upper)], -lower[np.isfinite(lower)]])
        self.programs += 1
        q = np.concatenate([-E.T @ e, np.zeros(k)])
        z, found = _call(self.settings.backend, backend, P, q, G, h)
        return z[:p], found


def _call(name: str, backend: Backend, P: Array, q: Array, G: Array,
          h: Array) -> tuple[Array, bool]:
    """Return the backend's z for min z^T P z / 2 + q^T z, G z <= h, and whether it vouches for it.

    Where it gave nothing finite, z is zero.
    """
    import qpsolvers
    from scipy.sparse import csc_matrix  # type: ignore[import-untyped]

    kind = csc_matrix if backend.sparse else np.asarray
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # backends warn of what their status says anyway
        try:
            problem = qpsolvers.Problem(kind(P), q, kind(G), h)
            solution = qpsolvers.solve_problem(problem, solver=name, **backend.options)
        except Exception:  # backends raise whatever they like; all of it is a failure of theirs
            return np.zeros(len(q)), False
    if solution.x is None or not np.isfinite(solution.x).all():
        return np.zeros(len(q)), False
    return np.asarray(solution.x), bool(solution.found)
