"""The Task Priority Matrix: all priorities in one matrix F, x = J^# F b."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, final

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.certificate import certify
from solvers.kernels.published import priority_matrix, published
from solvers.kernels.rows import INACCURATE, SOLVED
from solvers.kernels.saturation import NO_LIMITS, saturation
from solvers.kernels.staircase import staircase
from solvers.resolver import (
    Handles,
    Resolution,
    Resolver,
    Status,
    refuse_inequality,
    register,
)
from solvers.workspace import WORKSPACE

FORMS = ("staircase", "published")
_SOLVED = Status.SOLVED


@final
class SaturatedResolution(Resolution):
    """A resolution that says which joints are at a bound, and how much of each level is left.

    Attributes beside those of `Resolution`; n joints, L levels
    ----------
    saturated : (n,) int8, +1 for a joint held at its upper bound, -1 at its lower one, 2 where both
        are one, 0 for a free joint.
    scaling : (L,) how much of its target each level gets, 1 - |A_k x - b_k| / |b_k| and not below
        zero: 1 exactly where the level is met. For the bounds 1, or 0 where rows on one joint
        exclude each other.
    """

    __slots__ = ()

    def __init__(self, x: Array, status: Status, memory: Array) -> None:
        self.x, self.status, self.memory = x, status, memory

    @property
    def iterations(self) -> int:  # type: ignore[override]
        """Levels resolved with a set of saturated joints: 1 where the first set was right."""
        return int(self.memory[-1])

    @property
    def saturated(self) -> NDArray[np.int8]:
        """Which bound each joint is held at: (n,)."""
        part: Array = self.memory[:len(self.x)]
        return part.astype(np.int8)

    @property
    def scaling(self) -> Array:
        """How much of its target each level gets: (L,)."""
        part: Array = self.memory[len(self.x):-1].copy()
        return part


@final
@register
@dataclass(frozen=True, kw_only=True)
class Tpm(Resolver):
    """Task priority through a factorisation of J^T, eqs. (7)-(10), (12) and (14).

    form = "staircase": exact at every rank and for m > n. With damping on, the same x as
    `recursive`, to rounding.

    Limits, in this form: the first level may be bounds on single unknowns (joints), in any number
    of rows with one entry each. Joints that saturate leave the stack's columns, and come back where
    that serves the first level they hold back; the resolution is a `SaturatedResolution`. Unless
    the data are not finite, x keeps the bounds to rounding, and no level gives up anything for one
    below it. Of bounds on one joint that exclude each other the point of least violation is taken,
    as a norm. With damping off, SOLVED is the exact lexicographic answer, that of `hcod`, and does
    not depend on `memory` beyond rounding. Status.INACCURATE: the set of saturated joints did not
    settle, or rows are nearly parallel behind those above, and `certify` does not accept x; a
    level, or the way to the reference, may then be worse than it could be.
    With damping on, a level that it acts on is damped on the columns left; which joints saturate
    then follows the same rule but has no optimum to meet, so one that comes back for a level and
    saturates again stays, and `memory` is not used. Where no bound is in the way, x is that without
    bounds to the last digit.

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
        kernel = staircase if staircased else published
        code = kernel(h.A, h.lower, h.upper, h.sizes, x, self.damping, self.threshold,
                      self.rank_tolerance, WORKSPACE.array)
        if code == 0:
            return Resolution(x)
        return (self._within_bounds(h, None) if code < 0 and staircased
                else self._otherwise(h, x, code, memory))

    def _within_bounds(self, h: Hierarchy, memory: Any) -> Resolution:
        """Resolve h if its first level is bounds; otherwise refuse it, or forget the memory."""
        x = h.reference.copy()
        size = len(x) + len(h.sizes) + 1
        fits = memory is not None and len(memory) == size and self.damping == 0.0
        record = memory.copy() if fits else np.zeros(size)
        code = saturation(h.A, h.lower, h.upper, h.sizes, x, record, self.damping, self.threshold,
                          self.rank_tolerance, WORKSPACE.array)
        if code == SOLVED or (code == INACCURATE and certify(h, x).certified):
            return SaturatedResolution(x, _SOLVED, record)
        if code == INACCURATE:
            return SaturatedResolution(x, Status.INACCURATE, record)
        return self.solve(h) if code == NO_LIMITS else self._otherwise(h, x, code, memory)


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


def _published_matrix(h: Hierarchy, r: Tpm) -> Array:
    W, beta = np.empty((2 * h.m, max(h.m, h.n))), np.empty(h.m)
    F, T = np.empty((h.m, h.m)), np.empty((h.m, h.m))
    priority_matrix(h.A, h.lower, h.upper, h.sizes, h.reference, W, beta, F, T, r.damping,
                    r.threshold, r.rank_tolerance, np.empty(h.m + 3 * h.m * h.m))
    return F.T.copy()  # (10)
