"""Priorities as weights: one quadratic program."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import ClassVar, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from solvers.kernels.merged import BY_RULE, count_strict
from solvers.kernels.weighted import weighted, weighted_steps
from solvers.qp.backends import BACKENDS, backend_of
from solvers.qp.programs import slack_program
from solvers.qp.refinement import Rows
from solvers.resolver import Handles, Resolution, Resolver, number, one_of, register, whole_number
from solvers.resolvers.hcod import Hcod, warm_record
from solvers.resolvers.merged import Merged
from solvers.status import TOO_SMALL, UNPROVED, Status
from solvers.workspace import WORKSPACE, run

OWN = "own"
Mask = NDArray[np.bool_]
_SOLVED = Status.SOLVED
_OUTSIDE = 1e-9  # of |a| |x| + |side|: a larger miss means contradictory constraints
_NEAR = 1e-6  # distance, relative to 1 + |x|, at which a backend's x counts as on a side


@final
@register
@dataclass(frozen=True, kw_only=True)
class Weighted(Resolver):
    """Minimises sum_k w_k^2 ||violation of level k||^2 + mu^2 ||x - reference||^2.

    Not strict; the top levels of inequalities are constraints. The memory is the state of each row.
    docs/theory/weighted.md describes the settings and the status.

    ratio : weight of a level over that of the level below; the lowest level has weight 1.
    weights : weight of each level, in place of `ratio`; ignored for a hard or strict level. Strict
        levels at the top need none.
    strict_levels : number of top levels that keep strict priority, -1 for the first run of
        inequalities and all above; those below become one level of weighted rows, and `hcod`
        resolves this. What follows is then unused.
    regularisation : mu; pink and mink call mu^2 damping, 1e-12 by default.
    hard_levels : largest number of top levels that are constraints (inequalities only).
    backend : after the guesses: "own", an active-set method, or a backend of qpsolvers.
    tolerance, guesses, max_iterations : as in `hcod`, relative to |a| |x| + |side|.
    """

    name: ClassVar[str] = "weighted"
    handles: ClassVar[Handles] = "inequalities"
    strict: ClassVar[bool] = False  # a lower level can disturb a higher one a little
    damps: ClassVar[str] = "all active soft rows as one level"
    damps_with_bounds: ClassVar[str] = damps
    ratio: float = number(100.0, 1.0)
    weights: Sequence[float] | None = None
    strict_levels: int = whole_number(0, -1)
    regularisation: float = number(1e-6, open_below=True)
    hard_levels: int = whole_number(1, 0)
    backend: str = one_of(OWN, *BACKENDS)
    tolerance: float = number(1e-10, high=1e-3, open_below=True)
    guesses: int = whole_number(10, 1)
    max_iterations: int = whole_number(1000, 1)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.backend != OWN:
            backend_of(self.backend)
        if self.weights is not None:
            set_frozen(self, weights=_checked(self.weights))

    @property
    def label(self) -> str:
        """`weighted`, its weights or a ratio other than the default, and its backend."""
        ratio = "" if self.ratio == 100.0 else f" {self.ratio:g}"
        if self.weights is not None:
            ratio = " " + "/".join(f"{w:g}" for w in self.weights)
        count = "" if self.strict_levels < 0 else f" {self.strict_levels}"
        strict = f" below{count} strict" if self.strict_levels else ""
        return self.name + ratio + strict + (f" {self.backend}" if self.backend != OWN else "")

    @cached_property
    def _settings_for(self) -> Callable[[int], Array]:
        """The settings of the kernels, the weight of each level last, by the number of these."""
        return cache(lambda levels: np.array([
            self.damping, self.threshold, self.rank_tolerance, self.regularisation,
            self.tolerance, self.hard_levels, self.guesses, self.max_iterations,
            *self._weights(levels)]))

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h, starting from the row states of an earlier resolution if given."""
        if self.strict_levels:
            return self._below(h).solve(h, memory)
        x = h.start()
        record = warm_record(memory, 2 * h.m + 1)
        settings = self._settings_for(len(h.names))
        code = weighted(*h.rows, x, record, settings, WORKSPACE.array)
        if code == TOO_SMALL:
            return self._otherwise(h, x, code, memory)
        if code == UNPROVED:
            return self._continued(h, settings, record)
        return _reported(x, code, record)

    @cached_property
    def _known(self) -> dict[tuple[str, ...], Merged]:
        """Cache of `_below`."""
        return {}

    def _below(self, h: Hierarchy) -> Merged:
        """Return what resolves the levels of h below the strict ones, without a memory."""
        if h.names not in self._known:
            by_rule, levels = self.strict_levels < 0, len(h.names)
            strict = count_strict(*h.rows[1:], BY_RULE) if by_rule else self.strict_levels
            scales = (1.0 / self._weights(levels, strict)).tolist()
            self._known[h.names] = Merged(
                ratio=1.0, cap=0.0, regularisation=0.0, rank_tolerance=self.rank_tolerance,
                scales=dict(zip(h.names, scales, strict=True)),
                strict_levels=None if by_rule else min(strict, levels - 1),
                damping=self.damping, threshold=self.threshold)
        return self._known[h.names]

    def _weights(self, levels: int, strict: int = 0) -> Array:
        """Return weights (L,), 1 for the lowest; where they overflow, the status reports it.

        Of the levels at the top, so many are strict: weights may begin below them.
        """
        if self.weights is None:
            with np.errstate(over="ignore"):
                powers = self.ratio ** np.arange(levels - 1, -1, -1.0)
            return np.minimum(powers, np.finfo(float).max)
        missing = levels - len(self.weights)
        if not 0 <= missing <= strict:
            raise HierarchyError(f"weighted: {len(self.weights)} weights for {levels} levels")
        return np.array([*[1.0] * missing, *self.weights])

    def _continued(self, h: Hierarchy, settings: Array, record: Array) -> Resolution:
        """Continue after the guesses, from an x within the constraints or from a backend's x."""
        hard, x = record[h.m:2 * h.m] == np.inf, h.start()
        if hard.any():
            x, status = self._within(h, hard)
            if status is not Status.SOLVED:
                return Resolution(x, status, int(record.item(-1)))
        if self.backend != OWN:
            return self._by_backend(h, settings, record, hard, x)
        answer = np.array([x, h.reference])
        code = run(weighted_steps, *h.rows, answer, record, settings)
        return _reported(answer[0].copy(), code, record)

    def _within(self, h: Hierarchy, hard: Mask) -> tuple[Array, Status]:
        """Return the feasible x nearest to the reference; INACCURATE if there is none."""
        limits = h.changed(A=h.A[hard], lower=h.lower[hard], upper=h.upper[hard],
                           sizes=[hard.sum()], names=("constraints",), give=None)
        found = Hcod(rank_tolerance=self.rank_tolerance).solve(limits)
        x, status = found.x, found.status
        value, slack = limits.A @ x, limits.slacks(x)
        size = np.linalg.norm(limits.A, axis=1) * np.linalg.norm(x) + abs(value - slack)
        if status is Status.SOLVED and (abs(slack) > _OUTSIDE * size).any():
            status = Status.INACCURATE
        return x, status

    def _by_backend(self, h: Hierarchy, settings: Array, record: Array, hard: Mask,
                    inside: Array) -> Resolution:
        """Take the active rows from the backend's x, and verify or repair them."""
        found, vouched = self._backend_x(h, hard, record[h.m:2 * h.m])
        record[:h.m] = _acting(h, hard, found)
        x, before = h.start(), record[-1]
        code = run(weighted, *h.rows, x, record, settings)
        record[-1] += before
        if code != UNPROVED:
            return _reported(x, code, record)
        if vouched:
            return Resolution(found, Status.INACCURATE, int(record.item(-1)))
        return Resolution(inside, Status.BACKEND_FAILURE, int(record.item(-1)))

    def _backend_x(self, h: Hierarchy, hard: Mask, weight: Array) -> tuple[Array, bool]:
        """Return the backend's x (n,), and whether the backend vouches for it."""
        w, equal = np.where(hard, 1.0, weight), h.lower == h.upper
        rows = Rows(h.A * w[:, None], h.lower * w, h.upper * w).from_(h.reference)
        program = slack_program(
            rows.where(equal), rows.where(~equal & ~hard), rows.where(hard).normalised(),
            np.empty((0, h.n)), self.regularisation)
        d, vouched = program.solve(backend_of(self.backend))
        return h.reference + d[:h.n], vouched


def lexicographic_weights(violations: ArrayLike, tolerance: float, regularised: float = 0.0
                          ) -> tuple[float, ...]:
    """Return weights (L,) that keep each level within a tolerance of its strict violation.

    The rule of preemptive goal programming: what all lower levels together can gain in the sum
    must not outweigh `tolerance` of a level. docs/theory/weighted.md has the bound. The
    lowest weight is 1.

    violations : (L,) V_k, upper bounds on the violation of each level at the strict answer, in the
        unit of its rows; for instance `h.violations` of a strict resolution.
    tolerance : > 0, in the unit of the rows.
    regularised : upper bound on mu ||x* - reference||.

    Raises HierarchyError: a violation that is not a number >= 0, or a tolerance that is not > 0.

    Source: Sherali, Soyster, "Preemptive and nonpreemptive multi-objective programming:
    relationship and counterexamples", 1983.
    """
    V = np.asarray(violations, dtype=float)
    if V.ndim != 1 or not (np.isfinite(V) & (V >= 0.0)).all():
        raise HierarchyError(f"violations = {violations!r}, expected numbers >= 0, one per level")
    if not 0.0 < tolerance < np.inf or not 0.0 <= regularised < np.inf:
        raise HierarchyError(f"tolerance = {tolerance!r}, regularised = {regularised!r}, expected "
                             "numbers > 0 and >= 0")
    weights, below = [1.0], np.hypot(regularised, V[-1]) if V.size else 0.0
    for v in V[-2::-1]:
        weights.append(max(1.0, float(below / tolerance)))
        below = np.hypot(below, weights[-1] * v)
    return tuple(reversed(weights))


def _reported(x: Array, code: int, record: Array) -> Resolution:
    status = Status(code) if code else _SOLVED  # a look-up takes twice the time
    return Resolution(x, status, int(record.item(-1)), record, record[:len(record) // 2])


def _checked(weights: Sequence[float]) -> tuple[float, ...]:
    plain = isinstance(weights, (list, tuple, np.ndarray))
    if not plain or not all(isinstance(w, (int, float)) and 0.0 < w < np.inf for w in weights):
        raise HierarchyError(f"weighted: weights = {weights!r}, expected numbers > 0")
    return tuple(float(w) for w in weights)


def _acting(h: Hierarchy, hard: Mask, x: Array) -> Array:
    """Return +1 for a hard row near its upper side or a soft row above it, -1 below, else 0."""
    margin = np.where(hard, _NEAR * (1.0 + np.linalg.norm(x)) * np.linalg.norm(h.A, axis=1), 0.0)
    value = h.A @ x
    above, below = value - h.upper + margin, h.lower - value + margin
    return np.where(np.maximum(above, below) > 0.0, np.where(above >= below, 1.0, -1.0), 0.0)
