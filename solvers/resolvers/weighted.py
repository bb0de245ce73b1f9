"""Priorities as weights: one least-squares problem."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
from numpy.typing import ArrayLike

from hierarchy.errors import HierarchyError, as_float, refuse
from hierarchy.gate import array_of
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from solvers.kernels.merged import TOP_LIMITS, count_strict
from solvers.resolver import number, register, whole_number
from solvers.resolvers.merged import OneLevel


@final
@register
@dataclass(frozen=True, kw_only=True)
class Weighted(OneLevel):
    """Minimises sum_k w_k^2 ||violation of level k||^2 below the strict levels.

    Not strict: a lower level disturbs a higher one a little. Of several minimisers, x is the
    nearest to the reference. This is `merged` without a memory; docs/theory/weighted.md.

    ratio : weight of a level over that of the level below; the lowest level has weight 1.
    weights : weight of each level, in place of `ratio`. Strict levels at the top need none.
    strict_levels : number of top levels that are strict; None for the top level, if it has
        inequalities; -1 for the first run of levels with inequalities and all above.
    regularisation : mu: adds mu^2 (x_i - reference_i)^2 for unknowns that no equality names alone;
        pink and mink call mu^2 damping, 1e-12 by default.
    """

    name = "weighted"
    ratio: float = number(100.0, 1.0)
    weights: Sequence[float] | None = None
    strict_levels: int | None = whole_number(None, -1)
    regularisation: float = number(0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if (weights := self.weights) is not None:
            refuse(not isinstance(weights, list | tuple | np.ndarray)
                   or not all(0.0 < as_float(w) < np.inf for w in weights),
                   f"weighted: weights = {weights!r}: expected numbers > 0")
            set_frozen(self, weights=tuple(map(float, weights)))

    @property
    def label(self) -> str:
        """`weighted`, its weights or a ratio other than the default, and what is strict."""
        ratio = "" if self.ratio == 100.0 else f" {self.ratio:g}"
        if self.weights is not None:
            ratio = " " + "/".join(f"{w:g}" for w in self.weights)
        if self.strict_levels is None:
            return self.name + ratio
        count = "" if self.strict_levels < 0 else f" {self.strict_levels}"
        return f"{self.name}{ratio} below{count} strict"

    def _settings_of(self, h: Hierarchy) -> Array:
        levels = len(h.names)
        if self.weights is not None and len(self.weights) != levels:
            missing = levels - len(self.weights)
            if not 0 <= missing <= count_strict(*h.rows[1:], self._strict):
                raise HierarchyError(f"weighted: {len(self.weights)} weights for {levels} levels")
        return super()._settings_of(h)

    def _settings_for(self, names: tuple[str, ...]) -> Array:
        levels = len(names)
        weights = np.append(self._weights(levels), np.zeros(levels))
        return self._packed(min(self._strict, levels - 1), self.regularisation, 1.0, weights)

    @property
    def _strict(self) -> float:
        return TOP_LIMITS if self.strict_levels is None else float(self.strict_levels)

    def _weights(self, levels: int) -> Array:
        """Return weights (L,), 1 for the lowest; where they overflow, the status reports it."""
        if self.weights is None:
            with np.errstate(over="ignore"):
                powers = self.ratio ** np.arange(levels - 1, -1, -1.0)
            return np.minimum(powers, np.finfo(float).max)
        return np.array([*[1.0] * (levels - len(self.weights)), *self.weights])


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
    V = array_of("violations", violations)
    if V.ndim != 1 or not (np.isfinite(V) & (V >= 0.0)).all():
        raise HierarchyError(f"violations = {violations!r}, expected numbers >= 0, one per level")
    if not 0.0 < as_float(tolerance) < np.inf or not 0.0 <= as_float(regularised) < np.inf:
        raise HierarchyError(f"tolerance = {tolerance!r}, regularised = {regularised!r}, expected "
                             "numbers > 0 and >= 0")
    weights, below = [1.0], np.hypot(regularised, V[-1]) if V.size else 0.0
    for v in V[-2::-1]:
        weights.append(max(1.0, float(below / tolerance)))
        below = np.hypot(below, weights[-1] * v)
    return tuple(reversed(weights))
