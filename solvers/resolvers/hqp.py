"""A cascade of quadratic programs, one a level, through any backend that qpsolvers knows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar, final

import numpy as np
from numpy.linalg import norm

from hierarchy.problem import Array, Hierarchy
from solvers.qp.backends import Backend, backend_of
from solvers.qp.programs import null_space_program, slack_program
from solvers.qp.refinement import EXACT, Rows, below_largest, refined, split
from solvers.resolver import Handles, Resolution, Resolver, register
from solvers.status import Status

FORMS = ("null-space", "slack")

_SHARE = 0.01  # of the declared accuracy: what one level may be off by, since lower ones magnify it
_WIDER = (1.0, 100.0)  # times `slack`: tried one after the other


@final
@dataclass(frozen=True)
class Memory:
    """The step that every level took from the levels above it, each (n,), and the last one.

    `corrected` of the `programs` were not answered well enough to be taken as they were.
    """

    steps: tuple[Array, ...]
    programs: int
    corrected: int


@final
@register
@dataclass(frozen=True, kw_only=True)
class Hqp(Resolver):
    """Quadratic programs from the top level down, equalities and inequalities.

    What upper levels have settled is frozen by design so that no backend can find it infeasible.
    Settled are equalities, and inequalities that had to be violated: they leave the program as
    `form` says. The other inequalities above stay as rows, divided by their norms and moved out by
    `slack`; those that nothing can move any more are dropped. A level is divided by its largest
    entry.

    No answer of a backend is taken on trust. Without inequalities, the gradient that it leaves
    bounds its error; where the bound is within a hundredth of the backend's declared accuracy the
    answer is taken as it is, and otherwise corrected by one exact least-squares step. With
    inequalities, the active set is read off, resolved exactly, repaired where multipliers or rows
    say so, and taken when it passes the optimality conditions to 1e-10, so that neither the slack
    nor the backend's error leaves a trace below. Where that fails even from a program with 100
    times the slack, the status is INACCURATE (BACKEND_FAILURE if the backend gave nothing it
    vouched for), and x is that of the levels above, which hold.

    A level of inequalities that already hold asks nothing of the backend, nor does the reference
    where no inequality is left. `iterations` counts the programs that were solved. `memory` hands
    the steps of an earlier resolution to backends that can begin from one.

    backend : proxqp, osqp, quadprog, daqp, piqp or clarabel.
    form : "null-space", the program's unknowns are coordinates of what upper levels leave free;
        "slack", they are x and a slack for each row, and an orthonormal basis of what is settled
        is held by equality rows.
    slack : relaxation of the inequalities above, relative to the norm of the row.
    """

    backend: str = "proxqp"
    form: str = "null-space"
    slack: float = 1e-7

    name: ClassVar[str] = "hqp"
    handles: ClassVar[Handles] = "inequalities"

    def __post_init__(self) -> None:
        super().__post_init__()
        self._number("slack", 0.0, 1.0)
        self._one_of("form", FORMS)
        backend_of(self.backend)

    @property
    def label(self) -> str:
        """`hqp`, the backend, and the form where it is not the usual one."""
        form = " slack" if self.form == "slack" else ""
        return f"{self.name} {self.backend}{form}"

    @property
    def accuracy(self) -> float:
        """Error of x to expect, relative to 1 + |x|: the backend's."""
        return backend_of(self.backend).accuracy

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h; a failed program ends it with the x of the levels that were finished.

        NUMERICAL_FAILURE and x = 0 where numbers are not finite, or so large that products of a
        few of them overflow: some backends end the process on those.
        """
        if not _in_range(h):
            return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)
        known = memory.steps if isinstance(memory, Memory) else ()
        starts = known if len(known) == len(h.sizes) + 1 and known[0].shape == (h.n,) else ()
        with np.errstate(all="ignore"):
            try:
                return _Cascade(self, h, backend_of(self.backend), starts).run()
            except np.linalg.LinAlgError:  # an SVD of numbers beyond what a float can square
                return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)


def _in_range(h: Hierarchy) -> bool:
    """Whether the sides admit values, and all numbers are finite and below LARGEST.

    Sides are taken relative to the largest entry of their level.
    """
    sides = (h.lower <= h.upper) & (h.lower < np.inf) & (h.upper > -np.inf)
    if not sides.all() or not below_largest(h.A, h.reference):
        return False
    with np.errstate(over="ignore"):
        for A, lower, upper in h.levels():
            scale = float(abs(A).max(initial=0.0))
            finite = np.concatenate([lower[lower > -np.inf], upper[upper < np.inf]])
            if scale > 0.0 and not below_largest(finite / scale):
                return False
    return True


class _StopError(Exception):
    """A program without an answer that can be taken."""

    def __init__(self, status: Status) -> None:
        super().__init__(status.remedy)
        self.status = status


@dataclass
class _Cascade:
    """One run of the cascade.

    x so far; the basis N of the freedom left and F of what is settled, one orthonormal vector a
    column of N, a row of F; the inequalities to keep.
    """

    settings: Hqp
    h: Hierarchy
    backend: Backend
    starts: tuple[Array, ...]
    programs: int = 0
    corrected: int = 0
    steps: list[Array] = field(default_factory=list)
    x: Array = field(init=False)
    N: Array = field(init=False)
    F: Array = field(init=False)
    kept: Rows = field(init=False)

    def __post_init__(self) -> None:
        n = self.h.n
        self.x, self.N, self.F = np.zeros(n), np.eye(n), np.empty((0, n))
        self.kept = Rows.none(n)

    def run(self) -> Resolution:
        status = Status.SOLVED
        try:
            for A, lower, upper in self.h.levels():
                self._level(A, lower, upper)
            self._step(self._nearest())
        except _StopError as stop:
            status = stop.status
        memory = Memory(tuple(self.steps), self.programs, self.corrected)
        return Resolution(self.x, status, self.programs, memory)

    def _step(self, z: Array) -> None:
        x = self.x + self.N @ z
        if not np.isfinite(x).all():
            raise _StopError(Status.NUMERICAL_FAILURE)
        self.steps.append(x - self.x)
        self.x = x

    def _level(self, A: Array, lower: Array, upper: Array) -> None:
        """Move x to the minimum of a level; settle its equalities and what it must violate."""
        if not self.N.shape[1] or not A.any():
            self.steps.append(np.zeros(self.h.n))
            return
        scale, equal = float(abs(A).max()), lower == upper
        rows = Rows(A / scale, lower / scale, upper / scale)
        norms, M = norm(rows.A, axis=1), rows.A @ self.N
        goal = rows.where(equal).from_(self.x)
        limits = rows.where(~equal).from_(self.x)
        near = EXACT * (1.0 + norm(self.x))
        own, free = self._split(M[equal], norms[equal])
        broken = np.zeros(limits.lower.size)
        if not equal.any() and (abs(limits.excess(np.zeros(self.h.n))) <= near).all():
            z = np.zeros(self.N.shape[1])
        else:
            seen = own if equal.all() else self._split(M, norms)[0]
            lam = self._variable_damping(scale * M, seen.shape[1]) / scale
            z, broken = self._minimise(goal, limits, own, lam)
        self._step(z)
        fixed = equal.copy()
        fixed[~equal] = broken != 0
        if broken.any():
            own, free = self._split(M[fixed], norms[fixed])
        self.F = np.vstack([self.F, (self.N @ own).T])
        self.N = self.N @ free
        self.kept = self.kept.and_(rows.where(~fixed).normalised())

    def _seen(self, rows: Rows) -> Rows:
        return rows.seen(self.N, self.settings.rank_tolerance)

    def _split(self, M: Array, norms: Array) -> tuple[Array, Array]:
        return split(M, norms, self.settings.rank_tolerance)

    def _variable_damping(self, M: Array, rank: int) -> float:
        s = self.settings
        if not s.damping or not M.shape[0]:
            return 0.0
        smallest = np.linalg.svd(M, compute_uv=False)[-1] if rank == M.shape[0] else 0.0
        return float(s.damping * np.sqrt(max(0.0, 1.0 - (smallest / s.threshold) ** 2)))

    def _nearest(self) -> Array:
        """Return the z that leads nearest to the reference."""
        target = self.h.reference - self.x
        if not self.N.shape[1] or not self._movable().lower.size:
            return np.asarray(self.N.T @ target)
        goal = Rows(np.eye(self.h.n), target, target)
        return self._minimise(goal, Rows.none(self.h.n), np.eye(len(target)), 0.0, last=True)[0]

    def _movable(self) -> Rows:
        """Return the kept rows that a step along N can still move, as rows of that step."""
        moved = norm(self.kept.A @ self.N, axis=1) > self.settings.rank_tolerance
        return self.kept.where(moved).from_(self.x)

    def _minimise(self, goal: Rows, limits: Rows, own: Array, lam: float, last: bool = False
                  ) -> tuple[Array, Array]:
        """Minimise ||goal||^2 + ||excess of limits||^2 + lam^2 ||z||^2 within the kept rows.

        All rows are of the step N z; own is a basis of the z that the goal can see.
        Returns z and, for each limit, the side on which it remains violated.
        """
        kept, N = self._movable(), self.N
        p = N.shape[1]
        if last:
            E, e = np.eye(p), N.T @ goal.lower
        elif lam:
            E, e = np.vstack([goal.A @ N, lam * np.eye(p)]), np.pad(goal.lower, (0, p))
        else:
            E, e = goal.A @ N @ own @ own.T, goal.lower
        vouched = False
        for wider in _WIDER:
            z, found = self._ask(goal, limits, kept.relaxed(wider * self.settings.slack), lam, last)
            vouched |= found
            if not kept.lower.size and not limits.lower.size:
                return self._least_squares(z, E, e, own, lam), np.empty(0)
            for start in (z, np.zeros(p)):  # zero keeps all of `kept`: x does
                exact = refined(start, E, e, self._seen(limits), self._seen(kept),
                                self.settings.rank_tolerance)
                if exact is not None:
                    off = norm(exact[0] - z) > self._allowed()
                    self.corrected += bool(off)
                    return exact
        raise _StopError(Status.INACCURATE if vouched else Status.BACKEND_FAILURE)

    def _allowed(self) -> float:
        return float(_SHARE * self.backend.accuracy * (1.0 + norm(self.x)))

    def _least_squares(self, z: Array, E: Array, e: Array, own: Array, lam: float) -> Array:
        """Return z where it is shown to be near enough to the least squares, or the exact ones."""
        if lam:
            own, smallest = np.eye(len(z)), lam
        else:
            smallest = float(np.linalg.svd(E @ own, compute_uv=False).min(initial=np.inf))
        z = own.T @ z  # what is outside of it the level cannot see
        if norm(own.T @ (E.T @ e) - own.T @ (E.T @ (E @ (own @ z)))) <= (
                self._allowed() * smallest**2):
            return np.asarray(own @ z)
        self.corrected += 1
        return np.asarray(own @ np.linalg.lstsq(E @ own, e, rcond=None)[0])

    def _ask(self, goal: Rows, limits: Rows, kept: Rows, lam: float, last: bool
             ) -> tuple[Array, bool]:
        """Return z as the backend has it, and whether it vouches for it."""
        start = self.starts[len(self.steps)] if self.starts else None
        self.programs += 1
        if self.settings.form == "slack":
            d, found = slack_program(goal, limits, kept, self.F, lam, last, start).solve(
                self.backend)
            return self.N.T @ d[:self.h.n], found
        if start is not None:
            start = self.N.T @ start
        program = null_space_program(self._seen(goal), self._seen(limits), self._seen(kept), lam,
                                      start)
        z, found = program.solve(self.backend)
        return z[:self.N.shape[1]], found
