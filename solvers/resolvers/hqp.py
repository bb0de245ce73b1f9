"""A cascade of quadratic programs, one per level, through any backend of qpsolvers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.linalg import norm
from numpy.typing import NDArray

from hierarchy.gate import sound_rows
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from solvers.kernels.tolerances import NEGLIGIBLE
from solvers.qp.backends import backend_of
from solvers.qp.programs import null_space_program, slack_program
from solvers.qp.refinement import EXACT, Rows, below_largest, least, lengths, refined, split
from solvers.resolver import Resolution, Resolver, number, one_of, register
from solvers.status import Status

Mask = NDArray[np.bool_]
_SHARE = 0.01  # of the declared accuracy: allowed error of one level, which lower levels magnify
_BROKEN = 1e-4  # excess of a row that must hold, relative to 1 + its side
_WIDER = (1.0, 100.0)  # multiples of `slack`, tried in turn


@final
@register
@dataclass(frozen=True, kw_only=True)
class Hqp(Resolver):
    """A cascade of quadratic programs from the top level down, with inequalities at every level.

    What upper levels have settled leaves the programs, so that no backend can find it infeasible;
    no answer of a backend is used unchecked. docs/theory/hqp.md has the method and the
    meaning of each status. The memory (k, n), the step of each of k levels, warm-starts backends
    that accept an initial guess; `iterations` counts programs.

    backend : proxqp, osqp, quadprog, daqp, piqp or clarabel.
    form : "null-space", the unknowns are coordinates of the freedom that upper levels leave;
        "slack", they are x and a slack for each row, and equality rows hold an orthonormal basis of
        what is settled.
    slack : relaxation of the inequalities above, relative to the norm of the row.
    """

    backend: str = "proxqp"
    form: str = one_of("null-space", "slack")
    slack: float = number(1e-7, high=1.0)

    name = "hqp"
    handles = "inequalities"
    damps_with_bounds = "each level as if no inequality were active"

    def __post_init__(self) -> None:
        super().__post_init__()
        set_frozen(self, accuracy=backend_of(self.backend).accuracy)

    @property
    def label(self) -> str:
        """`hqp`, the backend, and the form if it is not the default."""
        form = " slack" if self.form == "slack" else ""
        return f"{self.name} {self.backend}{form}"

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h; a program that fails ends the cascade with the x of the finished levels.

        NUMERICAL_FAILURE and x = 0 for numbers that are not finite, or so large that products of a
        few of them overflow: some backends kill the process on those.
        """
        if not _in_range(h):
            return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)
        shape = len(h.sizes) + 1, h.n
        starts = memory if memory is not None and np.shape(memory) == shape else None
        with np.errstate(all="ignore"):
            try:
                return _Cascade(self, h, starts).run()
            except (np.linalg.LinAlgError, OverflowError):  # squares, in an SVD, of x or lambda
                return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)


def _in_range(h: Hierarchy) -> bool:
    """Whether each row admits a value, and all numbers are finite and below LARGEST.

    Sides are measured relative to the largest entry of their level.
    """
    if not sound_rows(*h.rows[:3]) or not below_largest(h.A, h.reference):
        return False
    for A, lower, upper in h.levels():
        scale, sides = float(abs(A).max(initial=0.0)), np.concatenate([lower, upper])
        if scale > 0.0 and not below_largest(sides[abs(sides) < np.inf], scale=scale):
            return False
    return True


class _StopError(Exception):
    """A program without a usable answer; its argument is the status."""


class _Cascade:
    """One run of the cascade.

    x : (n,) the answer so far.
    N, F : orthonormal bases of the remaining freedom (columns) and of what is settled (rows).
    kept : inequalities of the levels above that must still hold.
    """

    def __init__(self, settings: Hqp, h: Hierarchy, starts: Array | None) -> None:
        self.settings, self.h, self.starts = settings, h, starts
        self.backend, self.programs, self.steps = backend_of(settings.backend), 0, list[Array]()
        self.x, self.N, self.F = np.zeros(h.n), np.eye(h.n), np.empty((0, h.n))
        self.kept = Rows.none(h.n)

    def run(self) -> Resolution:
        status = Status.SOLVED
        try:
            for A, lower, upper in self.h.levels():
                self._level(A, lower, upper)
            self._step(self._nearest())
            side = np.minimum(abs(self.kept.lower), abs(self.kept.upper))
            near = _BROKEN * (1.0 + side) + EXACT * norm(self.x)
            if (abs(self.kept.excess(self.x)) > near).any():  # its numbers overflowed
                self.x, status = np.zeros(self.h.n), Status.NUMERICAL_FAILURE
        except _StopError as stop:
            status, = stop.args
        memory = np.array(self.steps).reshape(-1, self.h.n)
        return Resolution(self.x, status, self.programs, memory)

    def _step(self, z: Array) -> None:
        x = self.x + self.N @ z
        if not np.isfinite(norm(x)):
            raise np.linalg.LinAlgError
        self.steps.append(x - self.x)
        self.x = x

    def _level(self, A: Array, lower: Array, upper: Array) -> None:
        """Move x to the minimum of a level, then settle its equalities and violated rows."""
        if not self.N.shape[1] or not A.any():
            self.steps.append(np.zeros(self.h.n))
            return
        scale, equal = float(abs(A).max()), lower == upper
        rows = Rows(A / scale, lower / scale, upper / scale)
        sizes = lengths(rows.A)
        rows.A[sizes <= NEGLIGIBLE * sizes.max()] = 0.0
        own, free = self._split(rows.A[equal])
        fixed = equal.copy()
        fixed[~equal] = self._advance(rows, equal, own, scale) != 0
        if (fixed != equal).any():
            own, free = self._split(rows.A[fixed])
        if self.settings.form == "slack":
            self.F = np.vstack([self.F, (self.N @ own).T])
        self.N = self.N @ free
        if not fixed.all():
            self.kept = self.kept.and_(rows.where(~fixed).normalised())

    def _advance(self, rows: Rows, equal: Mask, own: Array, scale: float) -> Array:
        """Step to the minimum of a level; return the side on which each inequality is violated.

        rows : divided by their largest entry, `scale`; `equal` (m,) tells the equalities.
        """
        limits = rows.where(~equal).from_(self.x)
        near = EXACT * (1.0 + norm(self.x)) * lengths(limits.A)
        if not equal.any() and (abs(limits.excess(np.zeros(self.h.n))) <= near).all():
            self._step(np.zeros(self.N.shape[1]))
            return np.zeros(limits.lower.size)
        goal = rows.where(equal).from_(self.x)
        z, broken = self._minimise(goal, limits, own, self._lambda(rows.A, equal, own, scale))
        self._step(z)
        return broken

    def _split(self, A: Array) -> tuple[Array, Array]:
        return split(A @ self.N, lengths(A), self.settings.rank_tolerance)

    def _lambda(self, A: Array, equal: Mask, own: Array, scale: float) -> float:
        """Return lambda of a level, in its scaled rows; bounds at the top have none."""
        s, first = self.settings, self.N.shape[1] == self.h.n
        bounds = not equal.all() and (np.count_nonzero(A, axis=1) <= 1).all()
        if not s.damping or (first and bounds):
            return 0.0
        seen = own if equal.all() else self._split(A)[0]
        full = seen.shape[1] == len(A)
        smallest = np.linalg.svd(scale * (A @ self.N), compute_uv=False)[-1] if full else 0.0
        lam = s.damping * np.sqrt(max(0.0, 1.0 - (smallest / s.threshold) ** 2))
        return float(lam) / scale

    def _nearest(self) -> Array:
        """Return the z whose x is nearest to the reference."""
        target = self.h.reference - self.x
        if not self.N.shape[1] or not self._movable().lower.size:
            return np.asarray(self.N.T @ target)
        goal = Rows(np.eye(self.h.n), target, target)
        return self._minimise(goal, Rows.none(self.h.n), np.eye(len(target)), 0.0, last=True)[0]

    def _movable(self) -> Rows:
        """Return the rows from above that a step along N can still move, as rows of that step."""
        if not self.kept.lower.size:
            return self.kept
        moved = lengths(self.kept.A @ self.N) > self.settings.rank_tolerance
        return self.kept.where(moved).from_(self.x)

    def _minimise(self, goal: Rows, limits: Rows, own: Array, lam: float, last: bool = False
                  ) -> tuple[Array, Array]:
        """Minimise ||goal||^2 + ||excess of limits||^2 + lam^2 ||z||^2 within the kept rows.

        All rows are of the step N z; own is a basis of the z that the goal can see.
        Returns z and the side on which each limit remains violated. Raises _StopError if no
        answer could be verified.
        """
        s, kept, vouched = self.settings, self._movable(), False
        level = goal, limits, kept
        seen = goal_seen, limits_seen, kept_seen = [
            rows.seen(self.N, s.rank_tolerance) for rows in level]
        E, e = self._target(goal, goal_seen, own, lam, last)
        for wider in _WIDER:
            z, found = self._ask(seen if s.form == "null-space" else level, wider, lam, last)
            vouched |= found
            if not kept.lower.size and not limits.lower.size:
                return self._least_squares(z, E, e, own, lam), np.empty(0)
            rows = np.vstack([E, limits_seen.sided().A, kept_seen.sided().A])
            visible = split(rows, lengths(rows), EXACT)[0]  # backends went 1e8 along the rest
            exact = refined(visible @ (visible.T @ z), E, e, limits_seen, kept_seen,
                            s.rank_tolerance)
            if exact is not None:
                return exact
        raise _StopError(Status.INACCURATE if vouched else Status.BACKEND_FAILURE)

    def _target(self, goal: Rows, seen: Rows, own: Array, lam: float, last: bool
                ) -> tuple[Array, Array]:
        """Return E and e: the goal and its damping are ||E z - e||^2."""
        N, p = self.N, self.N.shape[1]
        if last:
            return np.eye(p), N.T @ goal.lower
        if lam:
            return (np.vstack([goal.A @ N, lam * np.eye(p)]),
                    np.concatenate([goal.lower, np.zeros(p)]))
        return seen.A @ own @ own.T, goal.lower

    def _least_squares(self, z: Array, E: Array, e: Array, own: Array, lam: float) -> Array:
        """Return z if its gradient proves it accurate enough, else the exact least squares."""
        if lam:
            own = np.eye(len(z))
        M, y = E @ own, own.T @ z  # the level cannot see the rest of z
        smallest = lam or float(np.linalg.svd(M, compute_uv=False).min(initial=np.inf))
        allowed = float(_SHARE * self.backend.accuracy * (1.0 + norm(self.x)))
        if norm(M.T @ (e - M @ y)) <= allowed * smallest**2:
            return np.asarray(own @ y)
        return least(E, e, lengths(E), self.settings.rank_tolerance)[0]

    def _ask(self, level: Sequence[Rows], wider: float, lam: float, last: bool
             ) -> tuple[Array, bool]:
        """Return the z of the backend, and whether the backend vouches for it.

        level : goal, limits and kept rows, of the step, or of z for the null-space form.
        """
        goal, limits, kept = level
        slack = wider * self.settings.slack
        kept = Rows(kept.A, kept.lower - slack, kept.upper + slack)
        start = None if self.starts is None else self.starts[len(self.steps)]
        self.programs += 1
        if self.settings.form == "slack":
            held = Rows(self.F, *[np.zeros(len(self.F))] * 2)
            program = (null_space_program(goal, limits, kept, 0.0, start, held) if last else
                       slack_program(goal, limits, kept, held, lam, start))
            d, found = program.solve(self.backend, wider)
            return self.N.T @ d[:self.h.n], found
        if start is not None:
            start = self.N.T @ start
        z, found = null_space_program(goal, limits, kept, lam, start).solve(self.backend, wider)
        return z[:self.N.shape[1]], found
