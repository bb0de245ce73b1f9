"""The Task Priority Matrix: all priorities in one matrix F, x = J^# F b."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, final

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.certificate import certify
from solvers.kernels.bounds import name_saturation, solve_without_bounds
from solvers.kernels.published import matrix_as_published, solve_as_published
from solvers.kernels.staircase import solve_by_staircase
from solvers.resolver import Handles, Resolution, Resolver, refuse_inequality, register
from solvers.resolvers.hcod import Hcod, solve_exactly
from solvers.resolvers.saturation import SaturatedResolution
from solvers.status import INACCURATE, NO_LIMITS, NUMERICAL_FAILURE, SOLVED, UNPROVED, Status
from solvers.workspace import WORKSPACE, run

FORMS = ("staircase", "published")
_OF_THE_ENGINE = Hcod.tolerance, Hcod.guesses, Hcod.max_iterations
_SOLVED = Status.SOLVED


@final
@register
@dataclass(frozen=True, kw_only=True)
class Tpm(Resolver):
    """Task priority through a factorisation of J^T, eqs. (7)-(10), (12) and (14).

    form = "staircase": exact at every rank and for m > n. With damping on, the same x as
    `recursive`, to rounding.

    Limits, in this form: the first level may be bounds on single unknowns (joints), in any number
    of rows with one entry each. Where x without bounds is within them it is the answer, to the last
    digit; otherwise the engine of `hcod` resolves, and the resolution is a `SaturatedResolution`:
    `scaling` is 1 - |A_k x - b_k| / |b_k| and not below zero, 1 exactly where a level is met, and
    `iterations` counts the sets of saturated joints tried, and steps by levels. Unless the data are
    not finite, x keeps the bounds to rounding, and no level gives up anything for one below it. Of
    bounds on one joint that exclude each other the point of least violation is taken, as a norm.
    With damping off, SOLVED is the exact lexicographic answer, and does not depend on `memory`
    beyond rounding. Status.INACCURATE: rows are nearly parallel behind those above, and `certify`
    does not accept x; a level, or the way to the reference, may then be worse than it could be.
    Damping is that of `hcod`; `memory` is then not used.

    form = "published": plain QR and Gauss-Jordan elimination with pivot blocks R_ii, as printed.
    It departs from the strict answer where a level above the last loses rank and no freedom is left
    over. The pivots R_ii^# are damped by their own smallest singular value, J^# is not; while the
    rows of J are independent that is again the x of `recursive`, to rounding. Its rank_tolerance is
    absolute for singular values: times the largest row norm of J.
    """

    name: ClassVar[str] = "tpm"
    handles: ClassVar[Handles] = "bounds"
    form: str = "staircase"

    def __post_init__(self) -> None:
        super().__post_init__()
        self._one_of("form", FORMS)
        if self.form == "published":
            object.__setattr__(self, "handles", "equalities")

    @property
    def strict(self) -> bool:
        """Whether priorities are respected exactly at any rank: in the staircase form."""
        return self.form == "staircase"

    @property
    def label(self) -> str:
        """`tpm`, or `tpm published`."""
        return self.name if self.strict else f"{self.name} {self.form}"

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h; with bounds, beginning at the saturation of an earlier resolution if given.

        Without bounds direct, and `memory` is not used. With them a `SaturatedResolution`.
        """
        staircased = self.form == "staircase"
        if staircased and memory is not None:
            return self._within_bounds(h, memory)
        x = h.reference.copy()
        kernel = solve_by_staircase if staircased else solve_as_published
        code = kernel(h.A, h.lower, h.upper, h.sizes, x, self._settings, WORKSPACE.array)
        if code == SOLVED or (code == INACCURATE and certify(h, x).certified):
            return Resolution(x)
        return (self._within_bounds(h, None) if code < 0 and staircased
                else self._otherwise(h, x, code, memory))

    @cached_property
    def _settings(self) -> Array:
        return np.array([self.damping, self.threshold, self.rank_tolerance, *_OF_THE_ENGINE])

    def _within_bounds(self, h: Hierarchy, memory: Any) -> Resolution:
        """Resolve h if its first level is bounds; otherwise refuse it, or forget the memory."""
        x = h.reference.copy()
        first = len(x) + len(h.sizes)
        size = first + 3 * len(h.lower) + 3
        known = memory is not None and len(memory) == size and self.damping == 0.0
        record = memory.copy() if known else np.zeros(size)
        code = run(solve_without_bounds, h.A, h.lower, h.upper, h.sizes, x, record, self._settings)
        if code == UNPROVED:
            inner = record[first:]
            known = bool(inner[-3] + inner[-2] > 0.0)
            code = solve_exactly(h, x, inner, self._settings, known)
        if code == NO_LIMITS:
            return self.solve(h)
        if code < 0 or code == NUMERICAL_FAILURE:
            return self._otherwise(h, x, code)
        name_saturation(h.A, h.lower, h.upper, h.sizes, x, record, WORKSPACE.array)
        sure = code == SOLVED or certify(h, x).certified
        return SaturatedResolution(x, _SOLVED if sure else Status.INACCURATE,
                                   int(record[-3] + record[-2]), record, len(h.sizes), record)


@final
@dataclass(frozen=True)
class TaskPriorityMatrix:
    """The matrix F of one hierarchy, and what each level puts into x.

    Attributes
    ----------
    F : (m, m) with x = J^# F b + null_space_term, eq. (7).
    G : (n, m) = J^# F.
    contributions : (L, n) G times the targets of one level.
    null_space_term : (n,) (I - J^# J) reference, eq. (14); x is the sum of all of these.
    """

    F: Array
    G: Array
    contributions: Array
    null_space_term: Array


def task_priority_matrix(h: Hierarchy, **settings: Any) -> TaskPriorityMatrix:
    """Return F of a hierarchy of equalities; the settings are those of `tpm`. Not for the loop.

    In the staircase form F = J G. Where J has dependent rows, other F give the same G.

    Raises
    ------
    HierarchyError : an inequality, a bad setting, or rows with entries that are not finite.
    """
    resolver = Tpm(**settings)
    if (h.lower < h.upper).any():  # as the published form does, which resolves no bounds
        refuse_inequality(Tpm(form="published"), h, int((h.lower < h.upper).argmax()))
    if resolver.solve(h).status is not Status.SOLVED:
        raise HierarchyError(f"no task priority matrix of {h}: {Status.NUMERICAL_FAILURE}")
    targets, zero = np.eye(h.m), np.zeros(h.n)
    G = np.array([_answer(resolver, h, b, zero) for b in targets]).reshape(h.m, h.n).T
    pairs = zip(h.offsets[:-1], h.offsets[1:], strict=True)
    return TaskPriorityMatrix(
        F=h.A @ G if resolver.strict else _published_matrix(h, resolver), G=G,
        contributions=np.array([G[:, i:j] @ h.lower[i:j] for i, j in pairs]).reshape(-1, h.n),
        null_space_term=_answer(resolver, h, np.zeros(h.m), h.reference))


def _answer(resolver: Tpm, h: Hierarchy, b: Array, reference: Array) -> Array:
    return resolver.solve(Hierarchy(h.A, b, b, h.sizes, reference, h.names)).x


def _published_matrix(h: Hierarchy, resolver: Tpm) -> Array:
    F = np.empty((h.m, h.m))
    run(matrix_as_published, h.A, h.lower, h.upper, h.sizes, F, resolver._settings)
    return F.T.copy()  # (10)
