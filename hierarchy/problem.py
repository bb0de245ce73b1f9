"""The prioritized problem in neutral form: packed rows, level sizes and a reference."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Sized
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hierarchy import gate
from hierarchy.errors import HierarchyError, brief, expect, refuse, whole
from hierarchy.gate import Array as Array
from hierarchy.gate import Sizes
from hierarchy.notebook import html_table
from hierarchy.records import set_frozen

_ROUNDING = 1e-10  # of a violation, relative to |a| (1 + |x|)
_ARRAYS = ("A", "lower", "upper", "reference", "metric", "give")  # what can be set


def _handed_out(kept: Callable[[Hierarchy], Any]) -> Any:
    """Return an array that is handed out as a view: numpy lets its holder change its shape."""
    def view(h: Hierarchy) -> Any:
        array = kept(h)
        return None if array is None else array.view()

    return property(view)


@lru_cache(maxsize=256)
def _layout(sizes: bytes) -> tuple[Sizes, Sizes]:
    """Return sizes and offsets of levels that nobody can change, from the bytes of the sizes."""
    kept = np.frombuffer(sizes, np.int64)
    offsets = np.frombuffer(np.append(0, kept.cumsum()).tobytes(), np.int64)
    return kept.view(), offsets.view()  # whose `base` is another array


@lru_cache(maxsize=256)
def _giving(give: bytes, sizes: bytes) -> tuple[int, ...]:
    """Return the levels with a row that gives, from the bytes of both; NaN gives too."""
    rows = np.flatnonzero(np.frombuffer(give))
    return tuple(np.unique(np.searchsorted(_layout(sizes)[1], rows, side="right") - 1).tolist())


class Hierarchy:
    """Levels of rows `lower <= A x <= upper`, most important first.

    Level k minimises the Euclidean norm of its violation without giving up any of the norms above
    it; among all such x the answer is the one nearest to `reference`. Arguments: see `from_levels`.

    A (m, n), lower, upper (m,) : the rows of all levels, stacked, and their bounds.
    sizes (L,), offsets (L + 1,) : rows of each level, zero is allowed; first row of each, and m.
    reference (n,), metric (n, n), give (m,) : see `from_levels`; metric and give may be None.
    names, named : of the L levels; a function that returns those of the m rows, or None.
    plain : whether there is neither metric nor give.
    rows, start() : A, lower, upper, sizes; a copy of the reference. For kernels only.

    Numbers may be written in place, as a `Stack` does, and are then not looked at: `solve` has a
    status for NaN. Shapes, types and sizes stay as they were checked: arrays are handed out as
    views, sizes and offsets read-only; see docs/arrays.md.
    """

    __slots__ = ("_parts", "m", "n", "named", "names", "plain", "rows", "start")

    A: Array = _handed_out(lambda h: h.rows[0])
    lower: Array = _handed_out(lambda h: h.rows[1])
    upper: Array = _handed_out(lambda h: h.rows[2])
    sizes: Sizes = _handed_out(lambda h: _layout(h.rows[3].tobytes())[0])
    offsets: Sizes = _handed_out(lambda h: _layout(h.rows[3].tobytes())[1])
    reference: Array = _handed_out(lambda h: h._parts["reference"])
    metric: Array | None = _handed_out(lambda h: h._parts["metric"])
    give: Array | None = _handed_out(lambda h: h._parts["give"])

    n: int
    m: int
    names: tuple[str, ...]
    named: Callable[[], tuple[str, ...]] | None
    plain: bool
    rows: tuple[Array, Array, Array, Sizes]
    start: Callable[[], Array]
    _parts: dict[str, Any]  # arguments of `Hierarchy`

    def __init__(self, A: ArrayLike, lower: ArrayLike, upper: ArrayLike, sizes: ArrayLike,
                 reference: ArrayLike | None = None, names: Sequence[str] | None = None,
                 metric: ArrayLike | None = None, give: ArrayLike | None = None) -> None:
        """Keep packed arrays, in the same memory if kernels can read it; else copies."""
        self._keep(A, lower, upper, sizes, reference, names, metric, give)
        self._check_values()

    @classmethod
    def trusted(cls, *parts: Any, named: Callable[[], tuple[str, ...]] | None = None,
                **others: Any) -> Hierarchy:
        """Return a hierarchy made of arguments of `Hierarchy`, whose values are not checked.

        For what a program works out, which may overflow: `solve` has a status for that. Shapes and
        sizes are checked as ever. `named` returns the names of the rows.
        """
        made = object.__new__(cls)
        made._keep(*parts, **others)
        set_frozen(made, named=named)
        return made

    @classmethod
    def from_levels(cls, levels: Sequence[Sequence[ArrayLike]], reference: ArrayLike | None = None,
                    names: Sequence[str] | None = None,
                    metric: ArrayLike | None = None,
                    give: Sequence[ArrayLike] | None = None) -> Hierarchy:
        """Pack copies of levels given as `(A, b)` or `(A, lower, upper)`.

        Parameters
        ----------
        levels : each `A (m_k, n)` with `b (m_k,)`, or with `lower (m_k,)` and `upper (m_k,)`.
        reference : (n,) or None for zero.
        names : one name per level for messages, each different, or None for "level 1", ...
        metric : (n, n) W, symmetric and positive definite, in which a step d to the reference has
            the squared length d^T W d; None for the identity.
        give : for each level one number >= 0 for all rows, or (m_k,), in their unit; None for zero:
            for the levels below and the reference, row i may be violated by |s_i| + give_i, s_i as
            at the least norm of its level.

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
        names = gate.level_names(names, len(levels))
        packed = list(map(gate.checked_level, names, levels))
        n, sizes = _columns(packed, names, reference), [len(lower) for _, lower, _ in packed]
        none = np.empty((0, n)), np.empty(0), np.empty(0)
        A, lower, upper = map(np.concatenate, zip(none, *packed, strict=True))
        return cls(A, lower, upper, sizes, _copied("reference", reference), names,
                   _copied("metric", metric),
                   None if give is None else _checked_give(give, names, sizes))

    def __setattr__(self, name: str, value: Any) -> None:
        """Set an array, checked as when made; a side need not fit the other, yet to be set."""
        if name not in _ARRAYS:
            raise HierarchyError(f"{name} of a hierarchy cannot be set; make another hierarchy")
        other = self.changed(**{name: value})
        open_sides = {"lower": {"upper": np.full(self.m, np.inf)},
                      "upper": {"lower": np.full(self.m, -np.inf)}}
        other.changed(**open_sides.get(name, {}))._check_values()
        set_frozen(self, **{slot: getattr(other, slot) for slot in self.__slots__})

    def __reduce__(self) -> tuple[Any, ...]:
        return Hierarchy.trusted, tuple(self._parts.values())

    def changed(self, **parts: Any) -> Hierarchy:
        """Return one with other arguments of `Hierarchy`, `trusted`; all others are shared."""
        return self.trusted(**{"named": self.named} | self._parts | parts)

    def copy(self) -> Hierarchy:
        """Return a copy with separate arrays, since a stack reuses its arrays in each tick."""
        return self.changed(**{name: part.copy() for name, part in self._parts.items()
                               if isinstance(part, np.ndarray)})

    def _keep(self, A: Any, lower: Any, upper: Any, sizes: Any, reference: Any = None,
              names: Sequence[str] | None = None, metric: Any = None, give: Any = None) -> None:
        """Accept arrays of matching shapes, or raise a HierarchyError."""
        A = gate.readable("A", A)
        if A.ndim != 2 or not A.shape[1]:
            raise HierarchyError(f"A has shape {A.shape}, expected (rows, n) with n >= 1")
        m, n = A.shape
        lower, upper = gate.shaped("lower", lower, (m,)), gate.shaped("upper", upper, (m,))
        reference = (np.zeros(n).view() if reference is None
                     else gate.shaped("reference", reference, (n,)))
        sizes = gate.checked_sizes(sizes, m)
        names = gate.level_names(names, len(sizes))
        parts = {"A": A, "lower": lower, "upper": upper, "sizes": sizes, "reference": reference,
                 "names": names,
                 "metric": None if metric is None else gate.shaped("metric", metric, (n, n)),
                 "give": None if give is None else gate.shaped("give", give, (m,))}
        set_frozen(self, rows=(A, lower, upper, sizes), start=reference.copy, m=m, n=n, names=names,
                   named=None, plain=metric is None and give is None, _parts=parts)

    def _check_values(self) -> None:
        """Raise a HierarchyError that names the first bad value, or return None."""
        if not gate.sound_rows(*self.rows[:3]):
            for name, level in zip(self.names, self.levels(), strict=True):
                gate.check_rows(name, *level)
        gate.check_finite("reference", self.reference)
        if self.metric is not None:
            gate.checked_metric(self.metric)
        if self.give is not None:
            for name, (first, last) in zip(self.names, self._bounds(), strict=True):
                gate.checked_give(name, self.give[first:last], last - first)

    @property
    def is_equality(self) -> bool:
        """Whether every row is an equality."""
        _, lower, upper, _ = self.rows
        return bool((lower == upper).all())

    def levels(self) -> Iterator[tuple[Array, Array, Array]]:
        """Yield `(A_k (m_k, n), lower_k (m_k,), upper_k (m_k,))` as views, top level first."""
        A, lower, upper, _ = self.rows
        for first, last in self._bounds():
            yield A[first:last], lower[first:last], upper[first:last]

    @property
    def giving(self) -> list[int]:
        """The levels with a row that gives."""
        give = self._parts["give"]
        return [] if give is None else list(_giving(give.tobytes(), self.rows[3].tobytes()))

    def refuse_extras(self, what: str, taker: str) -> None:
        """Raise a HierarchyError where `what`, this one, has what a taker would leave out."""
        has = "has a metric" if self.metric is not None else "gives" if self.giving else ""
        refuse(has, f"{what} {has}, which {taker} does not know")

    def _bounds(self) -> Iterator[tuple[int, int]]:
        """Yield the first row of each level and the one after its last."""
        return pairwise(self.offsets.tolist())

    def upper_part(self, count: int, sides: tuple[Array, Array] | None = None) -> Hierarchy:
        """Return the first `count` levels, as views, none of which gives.

        sides : lower and upper (m,), in place of those of all levels. Raises HierarchyError for
        another count or shape.
        """
        A, lower, upper, sizes = self.rows
        whole("upper_part: count", count, largest=len(sizes))
        if sides is not None:
            lower, upper = (gate.shaped("upper_part: sides", side, (self.m,)) for side in sides)
        m = int(_layout(sizes.tobytes())[1][count])
        part, names = object.__new__(Hierarchy), self.names[:count]
        rows = {"A": A[:m], "lower": lower[:m], "upper": upper[:m], "sizes": sizes[:count]}
        set_frozen(part, rows=tuple(rows.values()), start=self.start, m=m, n=self.n, names=names,
                   named=None, plain=self._parts["metric"] is None,
                   _parts=self._parts | rows | {"names": names, "give": None})
        return part

    def relaxed(self, level: int, x: ArrayLike) -> Hierarchy:
        """Return the hierarchy whose level is relaxed by its violations at x and by its `give`.

        For all levels below, and the reference, row i of the level may be violated by up to
        |s_i| + give_i at either side, where s_i is its violation at the least norm of its level. x
        (n,) is optimal for the levels down to this one, which do not give any more.
        """
        if (give := self.give) is None:
            raise HierarchyError("relaxed: no level of the hierarchy gives")
        whole("relaxed: level", level, largest=len(self.names) - 1)
        rows = slice(*self.offsets[level:level + 2])
        slack, lower, upper = self.slacks(x)[rows], self.lower.copy(), self.upper.copy()
        reach = np.linalg.norm(self.A[rows], axis=1) * (1.0 + float(np.linalg.norm(x)))
        slack[np.abs(slack) <= _ROUNDING * reach] = 0.0
        room = np.abs(slack) + give[rows]
        lower[rows] -= room
        upper[rows] += room
        give = give.copy()
        give[:rows.stop] = 0.0
        return self.changed(lower=lower, upper=upper, give=give)

    def slacks(self, x: ArrayLike) -> Array:
        """Signed violation of every row at x: (m,), positive above `upper`, zero inside.

        Raises HierarchyError for another shape.
        """
        A, lower, upper, _ = self.rows
        value = A @ gate.shaped("x", x, (self.n,))
        return np.maximum(value - upper, 0.0) - np.maximum(lower - value, 0.0)

    def violations(self, x: ArrayLike) -> Array:
        """Euclidean norm of each level's violation at x: (L,).

        Raises HierarchyError for another shape or an entry that is not finite.
        """
        x = gate.shaped("x", x, (self.n,))
        gate.check_finite("x", x)
        slack = self.slacks(x)
        return np.array([np.linalg.norm(slack[i:j]) for i, j in self._bounds()])

    def __repr__(self) -> str:
        return f"Hierarchy(n={self.n}, sizes={self.sizes.tolist()})"

    def _repr_html_(self) -> str:
        rows = [(name, len(A), int((lower == upper).sum()), int((lower < upper).sum()))
                for name, (A, lower, upper) in zip(self.names, self.levels(), strict=True)]
        return html_table(f"Hierarchy: {self.n} unknowns, most important level first",
                          ("level", "rows", "equalities", "inequalities"), rows)


def _copied(what: str, value: ArrayLike | None) -> Array | None:
    return None if value is None else gate.array_of(what, value)


def _checked_give(give: Sequence[ArrayLike], names: Sequence[str], sizes: list[int]) -> Array:
    expect("give", give, Sized, "give a number, or one for each row, for every level")
    if len(give) != len(names):
        raise HierarchyError(f"give has {len(give)} entries for {len(names)} levels")
    return np.concatenate([np.empty(0), *map(gate.checked_give, names, give, sizes)])


def _columns(packed: list[tuple[Array, Array, Array]], names: tuple[str, ...],
             reference: ArrayLike | None) -> int:
    if not packed and reference is None:
        raise HierarchyError("no levels and no reference: the number of unknowns is not known")
    n = packed[0][0].shape[1] if packed else gate.array_of("reference", reference).size
    for name, (A, _, _) in zip(names, packed, strict=True):
        if A.shape[1] != n:
            raise HierarchyError(
                f"{name}: A has {A.shape[1]} columns where {names[0]} has {n}")
    if n == 0:
        raise HierarchyError("n = 0: a hierarchy needs at least one unknown")
    return n
