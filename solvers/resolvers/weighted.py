"""Priorities as weights: one quadratic program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, ClassVar, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.kernels.weighted import weighted, weighted_steps
from solvers.qp.backends import BACKENDS, backend_of
from solvers.qp.programs import slack_program
from solvers.qp.refinement import Rows
from solvers.resolver import Handles, Resolution, Resolver, register
from solvers.resolvers.hcod import Hcod
from solvers.status import SOLVED, TOO_SMALL, UNPROVED, Status
from solvers.workspace import WORKSPACE, run

OWN = "own"
_OUTSIDE = 1e-9  # of |a| |x| + |side|, by which constraints are missed that exclude each other
_NEAR = 1e-6  # distance to a side, relative to 1 + |x|, at which a backend's x may be on it


@final
@register
@dataclass(frozen=True, kw_only=True)
class Weighted(Resolver):
    """All levels in one sum, sum_k w_k^2 ||violation of level k||^2 + mu^2 ||x - reference||^2.

    Limits are constraints, as in pink and mink: the top `hard_levels` levels that have nothing but
    inequalities. The other inequalities cost what they are violated by. Below the constraints the
    answer is not strict: a level that conflicts with lower ones is missed by O(1 / ratio^2) more
    than it must be (Van Loan, "On the method of weighting for equality-constrained least-squares
    problems", 1985), and by how much depends on the units of all rows. No finite weights give the
    strict answer; `lexicographic_weights` bounds the difference.

    Equalities alone are solved by one QR factorisation of the weighted rows, which loses nothing to
    large weights: rows that are dependent by `rank_tolerance` are so whatever their weights. With
    inequalities, sets of acting rows are guessed and then changed step by step, each solved by that
    QR; SOLVED means that the set has been shown to be right (`kernels/weighted.py`). The status is
    INACCURATE where the constraints exclude each other, x being what violates them least, and where
    an acting row has between 1e-12 and 1e-7 of itself left behind the others, so that a little more
    or less decides whether it counts; and NUMERICAL_FAILURE where squares of weights overflow, from
    1e154. With damping on, the acting soft rows are damped as one level, and a right set need not
    exist.

    ratio : weight of a level over that of the level below; the lowest has weight 1. A sum of
        squares sees the square of it.
    weights : the weights themselves, one for each level, in place of `ratio`. Of a hard level it
        plays no role.
    regularisation : mu; 1e-6 is the default of pink and mink, where it is called damping = 1e-12.
    hard_levels : how many levels may be constraints.
    backend : what goes on where guesses end: "own", steps, or proxqp, osqp, quadprog, daqp, piqp,
        clarabel through qpsolvers, the rows that act at its x being shown to be right or repaired
        (BACKEND_FAILURE, INACCURATE if they cannot).
    tolerance : of hard rows and of sides, relative to |a| |x| + |side|.
    guesses : sets guessed before that, and to repair a backend's.
    max_iterations : steps, then Status.ITERATION_LIMIT: x keeps the constraints.

    The memory is what each row does. `iterations` counts factorisations.
    """

    name: ClassVar[str] = "weighted"
    handles: ClassVar[Handles] = "inequalities"
    ratio: float = 100.0
    weights: Sequence[float] | None = None
    regularisation: float = 1e-6
    hard_levels: int = 1
    backend: str = OWN
    tolerance: float = 1e-10
    guesses: int = 10
    max_iterations: int = 1000

    def __post_init__(self) -> None:
        super().__post_init__()
        self._number("ratio", 1.0, np.inf)
        self._number("regularisation", 0.0, np.inf, open_below=True)
        self._number("tolerance", 0.0, 1e-3, open_below=True)
        for setting, least in (("hard_levels", 0), ("guesses", 1), ("max_iterations", 1)):
            value = getattr(self, setting)
            if not isinstance(value, int) or isinstance(value, bool) or not least <= value < 2**31:
                raise HierarchyError(
                    f"weighted: {setting} = {value!r}, expected a whole number >= {least}")
        self._one_of("backend", (OWN, *BACKENDS))
        if self.backend != OWN:
            backend_of(self.backend)
        if self.weights is not None:
            object.__setattr__(self, "weights", _checked(self.weights))

    @property
    def strict(self) -> bool:
        """No: a lower level may take a little from a higher one."""
        return False

    @property
    def label(self) -> str:
        """`weighted`, its ratio or weights where it is not the usual one, and its backend."""
        ratio = "" if self.ratio == 100.0 else f" {self.ratio:g}"
        if self.weights is not None:
            ratio = " " + "/".join(f"{w:g}" for w in self.weights)
        return self.name + ratio + (f" {self.backend}" if self.backend != OWN else "")

    @cached_property
    def _known(self) -> dict[int, Array]:
        """What `_settings_for` has returned."""
        return {}

    def _settings_for(self, levels: int) -> Array:
        """What the kernels take: `Options`, with a weight for each level at the end."""
        if levels not in self._known:
            self._known[levels] = np.array([
                self.damping, self.threshold, self.rank_tolerance, self.regularisation,
                self.tolerance, self.hard_levels, self.guesses, self.max_iterations,
                *self._weights(levels)])
        return self._known[levels]

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h, beginning with what the rows did in an earlier resolution if one is given."""
        x, size = h.reference.copy(), 2 * len(h.lower) + 1
        fits = memory is not None and len(memory) == size
        record = memory.copy() if fits else np.zeros(size)
        settings = self._settings_for(len(h.sizes))
        code = weighted(h.A, h.lower, h.upper, h.sizes, x, record, settings, WORKSPACE.array)
        if code == SOLVED:
            return Resolution(x, Status.SOLVED, int(record[-1]), record)
        if code == TOO_SMALL:
            return self._otherwise(h, x, code, memory)
        if code == UNPROVED:
            return self._farther(h, settings, record)
        return Resolution(x, Status(code), int(record[-1]), record)

    def _weights(self, levels: int) -> Array:
        if self.weights is None:
            return _geometric(self.ratio, levels)
        if len(self.weights) != levels:
            raise HierarchyError(f"weighted: {len(self.weights)} weights for {levels} levels")
        return np.array(self.weights)

    def _farther(self, h: Hierarchy, settings: Array, record: Array) -> Resolution:
        """Go on where guesses ended: from an x within the constraints, or a backend's."""
        hard, x = record[h.m:2 * h.m] == np.inf, h.reference.copy()
        if hard.any():
            inside = self._within(h, hard)
            x = inside.x
            if inside.status is not Status.SOLVED:
                return Resolution(x, inside.status, int(record[-1]))
        if self.backend != OWN:
            return self._asked(h, settings, record, hard, x)
        answer = np.array([x, h.reference])
        code = run(weighted_steps, h.A, h.lower, h.upper, h.sizes, answer, record, settings)
        return Resolution(answer[0].copy(), Status(code), int(record[-1]), record)

    def _within(self, h: Hierarchy, hard: NDArray[np.bool_]) -> Resolution:
        """Return the x within the constraints nearest to the reference; INACCURATE if none is."""
        limits = Hierarchy(h.A[hard], h.lower[hard], h.upper[hard],
                           np.array([hard.sum()]), h.reference, ("constraints",))
        x, status = _nearest(limits, self.rank_tolerance)
        value, slack = limits.A @ x, limits.slacks(x)
        size = np.linalg.norm(limits.A, axis=1) * np.linalg.norm(x) + abs(value - slack)
        if status is Status.SOLVED and (abs(slack) > _OUTSIDE * size).any():
            status = Status.INACCURATE
        return Resolution(x, status)

    def _asked(self, h: Hierarchy, settings: Array, record: Array, hard: NDArray[np.bool_],
               inside: Array) -> Resolution:
        """Ask the backend which rows act, and show that they do."""
        w, equal = np.where(hard, 1.0, record[h.m:2 * h.m]), h.lower == h.upper
        rows = Rows(h.A * w[:, None], h.lower * w, h.upper * w).from_(h.reference)
        program = slack_program(
            rows.where(equal), rows.where(~equal & ~hard), rows.where(hard).normalised(),
            np.empty((0, h.n)), self.regularisation, False, None)
        d, found = program.solve(backend_of(self.backend))
        asked = h.reference + d[:h.n]
        record[:h.m] = _acting(h, hard, asked)
        x, made = h.reference.copy(), record[-1]
        code = run(weighted, h.A, h.lower, h.upper, h.sizes, x, record, settings)
        record[-1] += made
        if code != UNPROVED:
            return Resolution(x, Status(code), int(record[-1]), record)
        return (Resolution(asked, Status.INACCURATE, int(record[-1])) if found
                else Resolution(inside, Status.BACKEND_FAILURE, int(record[-1])))


def lexicographic_weights(violations: ArrayLike, tolerance: float, regularised: float = 0.0
                          ) -> tuple[float, ...]:
    """Return weights that keep the levels to what the strict answer misses, within a tolerance.

    The rule of preemptive goal programming: what all lower levels together may gain in the sum
    must not pay for `tolerance` of a level. The sum at its minimum x is at most the sum at the
    strict answer x*, so with w_k tolerance >= (sum_{j > k} w_j^2 V_j^2 + regularised^2)^(1/2)

        sum_{j <= k} w_j^2 (v_j(x)^2 - v_j(x*)^2) <= w_k^2 tolerance^2      for every k,

    and v_k(x)^2 <= v_k(x*)^2 + tolerance^2 for the first level that is not hard; for one further
    down, as far as the levels above it do not gain, which they only can by the tolerance of those
    above them. The lowest weight is 1. Sherali, Soyster, "Preemptive and nonpreemptive
    multi-objective programming: relationship and counterexamples" (1983), where such weights
    become equivalent ones since vertices lie apart; for least squares they bound.

    Parameters
    ----------
    violations : (L,) V_k, at least what each level is violated by at the strict answer, in the unit
        of its rows: a bound, or `h.violations` of a strict resolution.
    tolerance : > 0, in the unit of the rows.
    regularised : at least mu ||x* - reference||.

    Raises
    ------
    HierarchyError : a violation that is not a number >= 0, or a tolerance that is not one > 0.
    """
    V = np.asarray(violations, dtype=float)
    if V.ndim != 1 or not (np.isfinite(V) & (V >= 0.0)).all():
        raise HierarchyError(f"violations = {violations!r}, expected numbers >= 0, one a level")
    if not 0.0 < tolerance < np.inf or not 0.0 <= regularised < np.inf:
        raise HierarchyError(f"tolerance = {tolerance!r}, regularised = {regularised!r}, expected "
                             "numbers > 0 and >= 0")
    weights, below = [1.0], np.hypot(regularised, V[-1]) if V.size else 0.0
    for v in V[-2::-1]:
        weights.append(max(1.0, float(below / tolerance)))
        below = np.hypot(below, weights[-1] * v)
    return tuple(reversed(weights))


def _checked(weights: Sequence[float]) -> tuple[float, ...]:
    plain = isinstance(weights, (list, tuple, np.ndarray))
    if not plain or not all(isinstance(w, (int, float)) and 0.0 < w < np.inf for w in weights):
        raise HierarchyError(f"weighted: weights = {weights!r}, expected numbers > 0")
    return tuple(float(w) for w in weights)


@cache
def _geometric(ratio: float, levels: int) -> Array:
    """Weights (L,), 1 for the lowest; where they overflow, so do the rows, and a status says so."""
    with np.errstate(over="ignore"):
        powers = ratio ** np.arange(levels - 1, -1, -1.0)
    return np.minimum(powers, np.finfo(float).max)


def _nearest(limits: Hierarchy, rank_tolerance: float) -> tuple[Array, Status]:
    inside = Hcod(rank_tolerance=rank_tolerance).solve(limits)
    return inside.x, inside.status


def _acting(h: Hierarchy, hard: NDArray[np.bool_], x: Array) -> Array:
    """+1 where a hard row is near its upper side at x or a soft one above it, -1 below, else 0."""
    margin = np.where(hard, _NEAR * (1.0 + np.linalg.norm(x)) * np.linalg.norm(h.A, axis=1), 0.0)
    value = h.A @ x
    above, below = value - h.upper + margin, h.lower - value + margin
    return np.where(np.maximum(above, below) > 0.0, np.where(above >= below, 1.0, -1.0), 0.0)
