"""The Task Priority Matrix: all priorities in one matrix F, x = J^# F b."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, final

import numpy as np

from hierarchy.errors import HierarchyError, expect
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from solvers.kernels.bounds import solve_within_bounds
from solvers.kernels.published import matrix_as_published, solve_as_published
from solvers.kernels.staircase import solve_by_staircase
from solvers.resolution import Resolution, SaturatedResolution
from solvers.resolver import Resolver, make, one_of, refuse_inequality, register, register_variant
from solvers.resolvers.hcod import Hcod, warm_record
from solvers.status import SOLVED, Status
from solvers.workspace import WORKSPACE, entry, run

FORMS = ("staircase", "published")
_OF_THE_ENGINE = Hcod.tolerance, Hcod.max_iterations


@final
@register
@dataclass(frozen=True, kw_only=True)
class Tpm(Resolver):
    """Task priority through a factorisation of J^T, eqs. (7)-(10), (12) and (14).

    form = "staircase": exact at every rank and for m > n; with damping, x is that of `recursive`,
        up to rounding. The first level may hold bounds on single unknowns. If x without them leaves
        the bounds, the method of `hcod` finds the exact answer, as a `SaturatedResolution` that
        keeps the bounds to rounding; its `scaling` is max(0, 1 - |A_k x - b_k| / |b_k|), exactly 1
        for a level that is met.
    form = "published", also `make("tpm-published")`: plain QR and Gauss-Jordan elimination as
        printed. It departs from the strict answer where a level above the last loses rank and a
        lower one needs the column of Q that this wastes. Equalities only; its rank_tolerance is
        absolute for the singular values of pivots, times the largest row norm of J.

    See docs/theory/tpm.md, and docs/theory/strict.md for damping.
    """

    name = "tpm"
    handles = "bounds"
    damps_with_bounds = Hcod.damps_with_bounds
    form: str = one_of(*FORMS)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.form == "published":
            set_frozen(self, handles="equalities", damps="each pivot", damps_with_bounds="",
                       strict=False)

    @property
    def label(self) -> str:
        """`tpm`, or `tpm-published`."""
        return self.name if self.strict else f"{self.name}-{self.form}"

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h, with bounds starting from the saturation of an earlier resolution if given.

        Without bounds a direct method that ignores `memory`; with them it returns a
        `SaturatedResolution`, which has a memory where an unknown is at a bound.
        """
        if memory is None or not self.strict:
            x = h.start()
            A, lower, upper, sizes = h.rows
            code = self._kernel(A, lower, upper, sizes, x, self._settings, WORKSPACE.array)
            if code == SOLVED:
                return Resolution(x)
            if not self.strict:
                return self._otherwise(h, x, code)
        x, levels = h.start(), len(h.names)
        record = warm_record(None if self.damping > 0.0 else memory, h.n + levels + 3 * h.m + 3)
        code = run(entry(solve_within_bounds), *h.rows, x, record, self._settings)
        if code < 0:
            refuse_inequality(self, h, -code - 1)
        steps = int(record.item(-3) + record.item(-2))
        if steps == 0:
            return Resolution(x, Status(code))
        return SaturatedResolution(x, Status(code), steps, record, levels,
                                   record if record[:h.n].any() else None)

    @cached_property
    def _kernel(self) -> Callable[..., int]:
        return entry(solve_by_staircase if self.strict else solve_as_published)

    @cached_property
    def _settings(self) -> Array:
        return np.array([self.damping, self.threshold, self.rank_tolerance, *_OF_THE_ENGINE])


register_variant("tpm-published", "tpm", form="published")


@final
@dataclass(frozen=True)
class TaskPriorityMatrix:
    """The matrix F of one hierarchy, and the contribution of each level to x.

    F : (m, m) with x = J^# F b + null_space_term, eq. (7).
    G : (n, m) = J^# F.
    contributions : (L, n) G times the targets of each level.
    null_space_term : (n,) (I - J^# J) reference, eq. (14); x is the sum of all of these.
    """

    F: Array
    G: Array
    contributions: Array
    null_space_term: Array


def task_priority_matrix(h: Hierarchy, **settings: Any) -> TaskPriorityMatrix:
    """Return F of a hierarchy of equalities, with settings of `tpm`; too slow for a control loop.

    In the staircase form F = J G. Where J has dependent rows, other matrices F give the same G.

    Raises HierarchyError: an inequality, an invalid setting, rows that are not finite, or a metric
    in the published form.
    """
    expect("task_priority_matrix: h", h, Hierarchy, "make one with Hierarchy.from_levels")
    resolver = make("tpm", **settings)
    if not resolver.strict:
        h.refuse_extras("the hierarchy", "the published form of tpm")
    if (h.lower < h.upper).any():  # worded as for the published form, which takes no bounds
        refuse_inequality(Tpm(form="published"), h, int((h.lower < h.upper).argmax()))
    status = resolver.solve(h).status
    if status is not Status.SOLVED:
        raise HierarchyError(f"no task priority matrix of {h}: {status}")
    targets, zero = np.eye(h.m), np.zeros(h.n)
    G = np.array([_answer(resolver, h, b, zero) for b in targets]).reshape(h.m, h.n).T
    pairs = zip(h.offsets[:-1], h.offsets[1:], strict=True)
    F = np.empty((h.m, h.m))
    if resolver.strict:
        F = h.A @ G
    else:
        run(matrix_as_published, *h.rows, F, resolver._settings)
        F = F.T.copy()  # (10)
    return TaskPriorityMatrix(
        F=F, G=G,
        contributions=np.array([G[:, i:j] @ h.lower[i:j] for i, j in pairs]).reshape(-1, h.n),
        null_space_term=_answer(resolver, h, np.zeros(h.m), h.reference))


def _answer(resolver: Resolver, h: Hierarchy, b: Array, reference: Array) -> Array:
    return resolver.solve(h.changed(lower=b, upper=b, reference=reference)).x
