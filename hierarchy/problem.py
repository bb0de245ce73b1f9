"""The prioritized problem in neutral form: packed rows, level sizes and a reference."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hierarchy.errors import HierarchyError, brief
from hierarchy.notebook import html_table

Array = NDArray[np.float64]
_ROUNDING = 1e-10  # of a violation, relative to 1 + |a| |x|
# Dimensions and type of what kernels read without a look at it.
_LAYOUT = {"A": (2, np.float64), "lower": (1, np.float64), "upper": (1, np.float64),
           "sizes": (1, np.int64), "offsets": (1, np.int64), "reference": (1, np.float64)}
_NUMBERS = "biufO"  # kinds of numpy's types that are real numbers, or may be


class Hierarchy:
    """Levels of rows `lower <= A x <= upper`, most important first.

    Level k minimises the Euclidean norm of its violation without giving up any of the norms above
    it; among all such x the answer is the one nearest to `reference`. A missing bound is infinite.

    A : (m, n) the rows of all levels, stacked from the top level down, C-contiguous.
    lower, upper : (m,) the bounds, in the unit of the rows; equal for an equality.
    sizes, offsets : (L,) rows of each level, zero is allowed; (L + 1,) first row of each, and m.
    reference : (n,) the x preferred where the levels leave freedom.
    names : L level names, used in messages.
    metric : (n, n) W, symmetric and positive definite, in which a step d to the reference has the
        squared length d^T W d, or None for the identity.
    give : (m,) >= 0, in the unit of the rows, or None for zero: for the levels below and the
        reference, row i may be violated by |s_i| + give_i, s_i as at the least norm of its level.
    named : a function that returns the names of the m rows, for messages; None if they have none.
    """

    __slots__ = ("A", "give", "lower", "metric", "named", "names", "offsets", "reference", "sizes",
                 "upper")

    def __init__(self, A: Array, lower: Array, upper: Array, sizes: NDArray[np.int64],
                 reference: Array, names: tuple[str, ...], metric: Array | None = None,
                 give: Array | None = None) -> None:
        """Wrap arrays without checking their values; `from_levels` checks."""
        self.A, self.lower, self.upper = A, lower, upper
        self.sizes, self.reference, self.names = sizes, reference, names
        self.metric, self.give = metric, give
        self.named: Callable[[], tuple[str, ...]] | None = None
        self.offsets = np.zeros(len(sizes) + 1, dtype=np.int64)
        np.cumsum(sizes, out=self.offsets[1:])

    def __setattr__(self, name: str, value: Any) -> None:
        """Keep an array as it is if kernels can read it: contiguous, of its type; else a copy."""
        if name in _LAYOUT:
            dimensions, kind = _LAYOUT[name]
            value = np.ascontiguousarray(value, kind)
            if value.ndim != dimensions:
                raise HierarchyError(f"{name} has shape {value.shape}, expected {dimensions} "
                                     f"dimension{'s' * (dimensions > 1)}")
        object.__setattr__(self, name, value)

    @classmethod
    def from_levels(cls, levels: Sequence[Sequence[ArrayLike]], reference: ArrayLike | None = None,
                    names: Sequence[str] | None = None,
                    metric: ArrayLike | None = None,
                    give: Sequence[ArrayLike] | None = None) -> Hierarchy:
        """Pack levels given as `(A, b)` or `(A, lower, upper)`.

        Parameters
        ----------
        levels : each `A (m_k, n)` with `b (m_k,)`, or with `lower (m_k,)` and `upper (m_k,)`.
        reference : (n,) or None for zero.
        names : one name per level for messages, each different, or None for "level 1", ...
        metric : (n, n) symmetric and positive definite, or None for the identity.
        give : for each level one number for all rows, or (m_k,); None for zero.

        Raises
        ------
        HierarchyError : a wrong type or shape, a NaN, an infinite entry of A or of an equality,
            lower > upper, n = 0, or no level and no reference; names level, row and value. A
            metric that is not symmetric and positive definite; a give that is not finite and at
            least zero.
        """
        if not isinstance(levels, Sequence) or isinstance(levels, str):
            raise HierarchyError("levels: expected a list of (A, b) or (A, lower, upper), got "
                                 f"{brief(levels)}")
        names = _level_names(names, len(levels))
        packed = [_checked_level(name, level) for name, level in zip(names, levels, strict=True)]
        n = _columns(packed, names, reference)
        ref = np.zeros(n) if reference is None else _vector("reference", reference, n)
        if not np.isfinite(ref).all():
            i = int(np.flatnonzero(~np.isfinite(ref))[0])
            raise HierarchyError(f"reference, entry {i}: {ref[i]} is not finite")
        return cls(np.ascontiguousarray(np.vstack([np.empty((0, n)), *(A for A, _, _ in packed)])),
                   np.concatenate([np.empty(0), *(low for _, low, _ in packed)]),
                   np.concatenate([np.empty(0), *(up for _, _, up in packed)]),
                   np.array([A.shape[0] for A, _, _ in packed], dtype=np.int64), ref, names,
                   None if metric is None else checked_metric(metric, n),
                   None if give is None else _checked_give(
                       give, names, [len(lower) for _, lower, _ in packed]))

    @property
    def n(self) -> int:
        """Number of unknowns."""
        return int(self.A.shape[1])

    @property
    def m(self) -> int:
        """Total number of rows of all levels."""
        return int(self.A.shape[0])

    @property
    def is_equality(self) -> bool:
        """Whether every row is an equality."""
        return bool((self.lower == self.upper).all())

    def levels(self) -> Iterator[tuple[Array, Array, Array]]:
        """Yield `(A_k (m_k, n), lower_k (m_k,), upper_k (m_k,))` as views, top level first."""
        for first, last in zip(self.offsets[:-1], self.offsets[1:], strict=True):
            yield self.A[first:last], self.lower[first:last], self.upper[first:last]

    @property
    def giving(self) -> list[int]:
        """The levels of which a row gives."""
        if self.give is None:
            return []
        pairs = zip(self.offsets[:-1], self.offsets[1:], strict=True)
        return [k for k, (i, j) in enumerate(pairs) if (self.give[i:j] > 0.0).any()]

    def copy(self) -> Hierarchy:
        """Return one with arrays of its own: a stack writes the same ones again in each tick."""
        metric = None if self.metric is None else self.metric.copy()
        give = None if self.give is None else self.give.copy()
        copied = Hierarchy(self.A.copy(), self.lower.copy(), self.upper.copy(), self.sizes.copy(),
                           self.reference.copy(), self.names, metric, give)
        copied.named = self.named
        return copied

    def upper_part(self, count: int) -> Hierarchy:
        """Return the first `count` levels, as views, of which none gives."""
        m = self.offsets[count]
        return Hierarchy(self.A[:m], self.lower[:m], self.upper[:m], self.sizes[:count],
                         self.reference, self.names[:count], self.metric)

    def relaxed(self, level: int, x: ArrayLike) -> Hierarchy:
        """Return the hierarchy that has room for what the rows of a level miss at x, and give.

        For all levels below, and the reference, row i of the level may be violated by up to
        |s_i| + give_i at either side, where s_i is its violation at the least norm of its level. x
        (n,) is optimal for the levels down to this one, which do not give any more.
        """
        assert self.give is not None, "the hierarchy gives"
        rows = slice(self.offsets[level], self.offsets[level + 1])
        slack, lower, upper = self.slacks(x)[rows], self.lower.copy(), self.upper.copy()
        reach = np.linalg.norm(self.A[rows], axis=1) * float(np.linalg.norm(x))
        slack[np.abs(slack) <= _ROUNDING * (1.0 + reach)] = 0.0
        room = np.abs(slack) + self.give[rows]
        lower[rows] -= room
        upper[rows] += room
        give = self.give.copy()
        give[:self.offsets[level + 1]] = 0.0
        return Hierarchy(self.A, lower, upper, self.sizes, self.reference, self.names, self.metric,
                         give)

    def slacks(self, x: ArrayLike) -> Array:
        """Signed violation of every row at x: (m,), positive above `upper`, zero inside.

        Raises HierarchyError for another shape.
        """
        value = self.A @ _vector("x", x, self.n)
        return np.maximum(value - self.upper, 0.0) - np.maximum(self.lower - value, 0.0)

    def violations(self, x: ArrayLike) -> Array:
        """Euclidean norm of each level's violation at x: (L,).

        Raises HierarchyError for another shape or an entry that is not finite.
        """
        x = _vector("x", x, self.n)
        for (i,) in np.argwhere(~np.isfinite(x))[:1]:
            raise HierarchyError(f"x, entry {i}: {x[i]} is not finite")
        slack = self.slacks(x)
        pairs = zip(self.offsets[:-1], self.offsets[1:], strict=True)
        return np.array([np.linalg.norm(slack[i:j]) for i, j in pairs])

    def __repr__(self) -> str:
        return f"Hierarchy(n={self.n}, sizes={self.sizes.tolist()})"

    def _repr_html_(self) -> str:
        rows = [(name, len(A), int((lower == upper).sum()), int((lower < upper).sum()))
                for name, (A, lower, upper) in zip(self.names, self.levels(), strict=True)]
        return html_table(f"Hierarchy: {self.n} unknowns, most important level first",
                          ("level", "rows", "equalities", "inequalities"), rows)


def _level_names(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    if names is None:
        return tuple(f"level {k + 1}" for k in range(count))
    if isinstance(names, str) or not all(isinstance(name, str) for name in names):
        raise HierarchyError(f"names: expected a list of texts, got {brief(names)}")
    if len(names) != count:
        raise HierarchyError(f"{len(names)} names for {count} levels")
    for name, times in Counter(names).items():
        if times > 1:
            raise HierarchyError(f"{times} levels are named {name!r}; give each its own name")
    return tuple(names)


def _checked_level(name: str, level: Sequence[ArrayLike]) -> tuple[Array, Array, Array]:
    if not isinstance(level, (tuple, list)) or len(level) not in (2, 3):
        raise HierarchyError(f"{name}: expected (A, b) or (A, lower, upper), got {brief(level)}")
    A = _array(f"{name}: A", level[0])
    if A.ndim != 2:
        raise HierarchyError(f"{name}: A has shape {A.shape}, expected (rows, n)")
    lower = _vector(f"{name}: lower" if len(level) == 3 else f"{name}: b", level[1], A.shape[0])
    upper = lower.copy() if len(level) == 2 else _vector(f"{name}: upper", level[2], A.shape[0])
    check_rows(name, A, lower, upper)
    return A, lower, upper


def check_rows(name: str, A: Array, lower: Array, upper: Array) -> None:
    """Raise a HierarchyError that names the first bad row of a level, or return None.

    Shapes: A (m_k, n), lower and upper (m_k,).
    """
    if (np.isfinite(A).all() and (lower <= upper).all() and (lower < np.inf).all()
            and (upper > -np.inf).all()):
        return
    for row, column in np.argwhere(~np.isfinite(A))[:1]:
        raise HierarchyError(f"{name}, row {row}: A[{row}, {column}] is {A[row, column]}")
    for side, values in (("lower", lower), ("upper", upper)):
        for (row,) in np.argwhere(np.isnan(values))[:1]:
            raise HierarchyError(f"{name}, row {row}: {side} is nan")
    for (row,) in np.argwhere((lower > upper) | (lower == np.inf) | (upper == -np.inf))[:1]:
        raise HierarchyError(
            f"{name}, row {row}: no value lies between lower {lower[row]} and upper {upper[row]}")


def checked_metric(metric: ArrayLike, n: int | None = None) -> Array:
    """Return a metric (n, n), n being any number if None.

    Raises HierarchyError if it has another shape, an entry that is not finite, or is not symmetric
    or not positive definite, up to rounding.
    """
    W = _array("metric", metric)
    size = W.shape[0] if n is None and W.ndim else n or 0
    if W.shape != (size, size):
        raise HierarchyError(f"metric has shape {W.shape}, expected ({size}, {size})")
    for i, j in np.argwhere(~np.isfinite(W))[:1]:
        raise HierarchyError(f"metric[{i}, {j}] is {W[i, j]}")
    rounding = size * float(np.finfo(float).eps) * abs(W).max(initial=0.0)
    for i, j in np.argwhere(abs(W - W.T) > rounding)[:1]:
        raise HierarchyError(f"metric is not symmetric: [{i}, {j}] is {W[i, j]} and [{j}, {i}] is "
                             f"{W[j, i]}")
    smallest = np.linalg.eigvalsh(W).min(initial=np.inf)
    if not smallest > rounding:
        raise HierarchyError("metric is not positive definite: its smallest eigenvalue is "
                             f"{smallest:.3g}")
    return W


def _checked_give(give: Sequence[ArrayLike], names: Sequence[str], sizes: list[int]) -> Array:
    if len(give) != len(names):
        raise HierarchyError(f"give has {len(give)} entries for {len(names)} levels")
    return np.concatenate([np.empty(0), *(checked_give(name, one, size) for name, one, size in zip(
        names, give, sizes, strict=True))])


def checked_give(name: str, give: ArrayLike, size: int) -> Array:
    """Return what the rows of a level give (size,), of one number or as many.

    Raises HierarchyError, naming the level, for another shape or a number that is not finite and at
    least zero.
    """
    rows = _array(f"{name}: give", give)
    if rows.shape not in ((), (size,)):
        raise HierarchyError(f"{name}: give has shape {rows.shape}, expected one number or "
                             f"({size},)")
    rows = np.broadcast_to(rows, (size,)).copy()
    for i in np.flatnonzero(~(np.isfinite(rows) & (rows >= 0.0)))[:1]:
        raise HierarchyError(f"{name}, row {i}: give is {rows[i]}, expected a number >= 0")
    return rows


def _columns(packed: list[tuple[Array, Array, Array]], names: tuple[str, ...],
             reference: ArrayLike | None) -> int:
    if not packed and reference is None:
        raise HierarchyError("no levels and no reference: the number of unknowns is not known")
    n = packed[0][0].shape[1] if packed else _array("reference", reference).size
    for name, (A, _, _) in zip(names, packed, strict=True):
        if A.shape[1] != n:
            raise HierarchyError(
                f"{name}: A has {A.shape[1]} columns where {names[0]} has {n}")
    if n == 0:
        raise HierarchyError("n = 0: a hierarchy needs at least one unknown")
    return n


def _vector(what: str, value: ArrayLike, size: int) -> Array:
    vector = _array(what, value)
    if vector.shape != (size,):
        raise HierarchyError(f"{what} has shape {vector.shape}, expected ({size},)")
    return vector


def _array(what: str, value: Any) -> Array:
    try:
        given = np.asarray(value)
        if given.dtype.kind in _NUMBERS:
            return np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise HierarchyError(f"{what} is not an array of numbers: {brief(value)}") from error
    kind = "real numbers: it is complex," if given.dtype.kind == "c" else "numbers:"
    raise HierarchyError(f"{what} is not an array of {kind} {brief(value)}")
