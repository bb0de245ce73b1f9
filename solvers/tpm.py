"""The Task Priority Matrix: all priorities in one matrix F, x = J^# F b."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, final

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from solvers.kernels.published import priority_matrix, published
from solvers.kernels.staircase import staircase
from solvers.resolver import Resolution, Resolver, Status, register
from solvers.workspace import WORKSPACE

FORMS = ("staircase", "published")


@final
@register
@dataclass(frozen=True, kw_only=True)
class Tpm(Resolver):
    """Task priority through a factorisation of J^T, eqs. (7)-(10), (12) and (14).

    form = "staircase": exact at every rank and for m > n. With damping on, the same x as
    `recursive`, to rounding.

    form = "published": plain QR and Gauss-Jordan elimination with pivot blocks R_ii, as printed.
    It departs from the strict answer where a level above the last loses rank and no freedom is left
    over. The pivots R_ii^# are damped by their own smallest singular value, J^# is not; while the
    rows of J are independent that is again the x of `recursive`, to rounding. Its rank_tolerance is
    absolute for singular values: times the largest row norm of J.
    """

    name: ClassVar[str] = "tpm"
    form: str = "staircase"

    def __post_init__(self) -> None:
        super().__post_init__()
        self._one_of("form", FORMS)

    @property
    def strict(self) -> bool:
        """Whether priorities are respected exactly at any rank: in the staircase form."""
        return self.form == "staircase"

    @property
    def label(self) -> str:
        """`tpm`, or `tpm published`."""
        return self.name if self.strict else f"{self.name} {self.form}"

    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h; direct, `memory` is not used."""
        x = h.reference.copy()
        kernel = staircase if self.form == "staircase" else published
        code = kernel(h.A, h.lower, h.upper, h.sizes, x, self.damping, self.threshold,
                      self.rank_tolerance, WORKSPACE.array)
        return self._otherwise(h, x, code, memory) if code else Resolution(x)


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
                    r.threshold, r.rank_tolerance)
    return F.T.copy()  # (10)
