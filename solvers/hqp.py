"""A cascade of quadratic programs, one a level, through any backend that qpsolvers knows."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, final

import numpy as np
from numpy.linalg import norm
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.resolver import Resolution, Resolver, Status, register

REFINEMENTS = 20  # bound on the steps from a backend's active set to the exact one
EXACT = 1e-10  # relative tolerance of the optimality conditions
ACTIVE = 1e-6  # distance to its side, relative to 1 + |side|, at which a row is a candidate


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
    A level of equalities below which no inequality was asked yet is plain least squares, and one
    whose inequalities hold already needs nothing: neither calls the backend. `iterations` counts
    the programs that were solved.

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
class _Rows:
    """Rows lower <= A z <= upper."""

    A: Array
    lower: Array
    upper: Array

    def excess(self, z: Array) -> Array:
        """How far A z is above `upper` (positive) or below `lower` (negative)."""
        value: Array = self.A @ z
        return value - np.clip(value, self.lower, self.upper)

    def seen(self, N: Array, x: Array) -> _Rows:
        """Return the same rows on z, where the unknown is x + N z."""
        value = self.A @ x
        return _Rows(self.A @ N, self.lower - value, self.upper - value)

    def where(self, chosen: NDArray[np.bool_]) -> _Rows:
        return _Rows(self.A[chosen], self.lower[chosen], self.upper[chosen])

    def and_(self, other: _Rows) -> _Rows:
        return _Rows(np.vstack([self.A, other.A]), np.concatenate([self.lower, other.lower]),
                     np.concatenate([self.upper, other.upper]))

    def relaxed(self, slack: float) -> _Rows:
        return _Rows(self.A, self.lower - slack, self.upper + slack)

    def sides(self, z: Array, near: float) -> Array:
        """+1 where A z is near or above `upper`, -1 near or below `lower`, 0 elsewhere.

        near : how near, relative to 1 + |side|.
        """
        value = self.A @ z
        up, low = np.isfinite(self.upper), np.isfinite(self.lower)
        side = np.zeros(len(value))
        side[low] -= value[low] <= self.lower[low] + near * (1.0 + abs(self.lower[low]))
        side[up] += value[up] >= self.upper[up] - near * (1.0 + abs(self.upper[up]))
        return side

    def at(self, side: Array) -> Array:
        return np.where(side > 0, self.upper, self.lower)


@dataclass
class _Cascade:
    """One run of the cascade: x so far, the freedom N left, the inequalities to keep."""

    settings: Hqp
    h: Hierarchy
    programs: int = 0
    x: Array = field(init=False)
    N: Array = field(init=False)
    kept: _Rows = field(init=False)

    def __post_init__(self) -> None:
        n = self.h.n
        self.x, self.N = np.zeros(n), np.eye(n)
        self.kept = _Rows(np.empty((0, n)), np.empty(0), np.empty(0))

    def run(self) -> Resolution:
        for A, lower, upper in self.h.levels():
            if not self._level(_Rows(A, lower, upper)):
                return Resolution(self.x, Status.BACKEND_FAILURE, self.programs)
        target = self.N.T @ (self.h.reference - self.x)
        nothing = _Rows(np.empty((0, target.size)), np.empty(0), np.empty(0))
        z = self._minimise(np.eye(target.size), target, nothing)
        if z is None:
            return Resolution(self.x, Status.BACKEND_FAILURE, self.programs)
        return Resolution(self.x + self.N @ z, Status.SOLVED, self.programs)

    def _level(self, rows: _Rows) -> bool:
        if not self.N.shape[1]:
            return True
        M, equal = rows.A @ self.N, rows.lower == rows.upper
        norms = norm(rows.A, axis=1)
        goal = rows.where(equal).seen(self.N, self.x)
        limits = rows.where(~equal).seen(self.N, self.x)
        lam = self._variable_damping(M, norms)
        own, _ = _split(goal.A, norms[equal], self.settings.rank_tolerance)
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
        _, free = _split(M[fixed], norms[fixed], self.settings.rank_tolerance)
        self.N = self.N @ free
        self.kept = self.kept.and_(rows.where(~fixed))
        return True

    def _variable_damping(self, M: Array, norms: Array) -> float:
        s = self.settings
        if not s.damping or not M.shape[0]:
            return 0.0
        rank = _split(M, norms, s.rank_tolerance)[0].shape[1]
        smallest = np.linalg.svd(M, compute_uv=False)[-1] if rank == M.shape[0] else 0.0
        return float(s.damping * np.sqrt(max(0.0, 1.0 - (smallest / s.threshold) ** 2)))

    def _minimise(self, E: Array, e: Array, limits: _Rows) -> Array | None:
        """Minimise ||E z - e||^2 + ||excess of limits||^2 over the z that the kept rows allow."""
        if not E.shape[1]:
            return np.zeros(0)
        kept = self.kept.seen(self.N, self.x)
        if not kept.lower.size and not limits.lower.size:
            return np.asarray(np.linalg.lstsq(E, e, rcond=None)[0])
        z, found = self._program(E, e, limits, kept.relaxed(self.settings.slack))
        for start in (z, np.zeros_like(z)):  # zero keeps all of `kept`: x does
            exact = _refined(start, E, e, limits, kept)
            if exact is not None:
                return exact
        return z if found else None

    def _program(self, E: Array, e: Array, limits: _Rows, kept: _Rows) -> tuple[Array, bool]:
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


def _split(M: Array, norms: Array, rank_tolerance: float) -> tuple[Array, Array]:
    """Orthonormal bases of the row space (p, rank) of M (k, p) and of its null space (p, p - rank).

    norms (k,) of the rows before any projection: M is measured against them.
    """
    scaled = M / np.where(norms > 0.0, norms, 1.0)[:, None]
    _, s, Vt = np.linalg.svd(scaled, full_matrices=True)
    rank = int((s > rank_tolerance).sum())
    return Vt[:rank].T, Vt[rank:].T


def _refined(z: Array, E: Array, e: Array, limits: _Rows, kept: _Rows) -> Array | None:
    """Move from a backend's z to the exact minimiser for its active set, corrected where needed.

    The result has passed the optimality conditions; None where no step did.
    """
    active, excess = kept.sides(z, ACTIVE), limits.excess(z)
    broken = np.sign(excess) * (abs(excess) > ACTIVE)
    for _ in range(REFINEMENTS):
        on, out = active != 0, broken != 0
        B, c = np.vstack([E, limits.A[out]]), np.concatenate([e, limits.at(broken)[out]])
        G, g = kept.A[on], kept.at(active)[on]
        new = z + np.linalg.pinv(G, rcond=EXACT) @ (g - G @ z)
        free = _split(G, np.ones(len(G)), EXACT)[1]
        new = new + free @ np.linalg.lstsq(B @ free, c - B @ new, rcond=EXACT)[0]
        scale = EXACT * (1.0 + norm(new))
        over, excess = kept.excess(new), limits.excess(new)
        near = np.where(on, active, kept.sides(new, EXACT))
        multipliers, rest = _multipliers(near, kept.A, B.T @ (c - B @ new))
        next_broken = np.sign(excess) * (abs(excess) > scale)
        feasible = (abs(over) <= scale).all()
        if feasible and (next_broken == broken).all() and rest <= EXACT * (1.0 + norm(B.T @ c)):
            return np.asarray(new)
        next_active = np.where(multipliers > 0.0, near, 0.0)
        next_active = np.where(abs(over) > scale, np.sign(over), next_active)
        if (next_active == active).all() and (next_broken == broken).all():
            return None
        active, broken = next_active, next_broken
    return None


def _multipliers(side: Array, A: Array, gradient: Array) -> tuple[Array, float]:
    """Multipliers >= 0 of the rows with a side that balance a gradient best, and what they leave.

    Rows may be dependent: any multipliers that leave nothing prove the minimum.
    """
    from scipy.optimize import nnls  # type: ignore[import-untyped]

    found, on = np.zeros(len(side)), side != 0
    if not on.any():
        return found, float(norm(gradient))
    try:
        found[on], rest = nnls((side[on, None] * A[on]).T, gradient)
    except RuntimeError:  # its bound on iterations
        rest = np.inf
    return found, float(rest)
