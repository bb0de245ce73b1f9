"""What every resolver is: a name, an immutable record of settings, a status that is the remedy."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from functools import cached_property
from typing import Any, ClassVar, Literal, TypeVar

import numpy as np

from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.problem import Array, Hierarchy
from solvers.status import TOO_SMALL
from solvers.status import Status as Status
from solvers.workspace import WORKSPACE

Handles = Literal["equalities", "bounds", "inequalities"]
_KINDS: tuple[Handles, ...] = ("equalities", "bounds", "inequalities")
_RESOLVED: dict[str, str] = {
    "equalities": "equalities only",
    "bounds": "equalities, and bounds on single unknowns in a first level of their own"}


class Resolution:
    """What a solve gave.

    Attributes
    ----------
    x : (n,) the answer, always finite.
    status : how the solve ended.
    iterations : steps of the resolver's own kind; 1 for a direct one.
    memory : state for the next solve, or None where the resolver keeps none.
    """

    __slots__ = ("iterations", "memory", "status", "x")

    def __init__(self, x: Array, status: Status = Status.SOLVED, iterations: int = 1,
                 memory: Any = None) -> None:
        self.x = x
        self.status = status
        self.iterations = iterations
        self.memory = memory

    def __repr__(self) -> str:
        return f"Resolution(x={self.x}, status={self.status.name}, iterations={self.iterations})"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Resolver(ABC):
    """A way to resolve a hierarchy, with its settings. Abstract.

    The settings that all resolvers share have one meaning in all of them. For a level with m_k
    rows, let B be its rows as seen through the null space of the levels above, and r what they
    still miss.

    damping : lambda_max, 0 = off. With it on and s < threshold, where s is the smallest of the m_k
        singular values of B (0 where the rows of B are dependent), the level minimises
        ||B z - r||^2 + lambda^2 ||z||^2 with lambda^2 = (1 - (s / threshold)^2) lambda_max^2. The
        null space handed to the levels below, and the null-space term of (14), stay undamped.
    threshold : the s below which damping starts, in the unit of the rows.
    rank_tolerance : a row counts as zero in the null space of what was taken before it when the
        norm of what is left is at most rank_tolerance times the norm of the row as given. A row of
        zeros is zero. So rows may have any scale, and a row parallel to an upper one up to this
        angle adds nothing.

    Raises
    ------
    HierarchyError : a setting that is not a number, or out of its range.
    """

    damping: float = 0.0
    threshold: float = 0.1
    rank_tolerance: float = 1e-8

    name: ClassVar[str]
    handles: ClassVar[Handles] = "equalities"
    """Which rows with lower < upper are resolved: none; bounds on single unknowns in the first
    level, which then has no other rows; or any. Others are refused."""

    def __post_init__(self) -> None:
        self._number("damping", 0.0, math.inf)
        self._number("threshold", 0.0, math.inf, open_below=True)
        self._number("rank_tolerance", 0.0, 1.0)

    def can_resolve(self, asked: Handles) -> bool:
        """Whether it takes the rows that somebody asks for."""
        return _KINDS.index(asked) <= _KINDS.index(self.handles)

    @property
    def label(self) -> str:
        """Name with the settings that make a different method of it, for tables and figures."""
        return self.name

    @property
    def strict(self) -> bool:
        """Whether priorities are respected exactly at any rank."""
        return True

    @property
    def accuracy(self) -> float:
        """Error of x to expect on a well-conditioned hierarchy, relative to 1 + |x|."""
        return 1e-9

    @cached_property
    def _settings(self) -> Array:
        """The settings in one array, as kernels take them: `Settings` first."""
        return np.array([self.damping, self.threshold, self.rank_tolerance])

    @abstractmethod
    def solve(self, h: Hierarchy, memory: Any = None) -> Resolution:
        """Resolve h, starting from the memory of an earlier resolution if given.

        Raises
        ------
        HierarchyError : rows that this resolver cannot handle. A numerical outcome is a status.
        """

    def _number(self, setting: str, low: float, high: float, open_below: bool = False) -> None:
        value = getattr(self, setting)
        number = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not number or not low <= value < high or (open_below and value == low):
            raise HierarchyError(f"{self.name}: {setting} = {value!r}, expected a number "
                                 f"{'>' if open_below else '>='} {low:g} and < {high:g}")
        object.__setattr__(self, setting, float(value))

    def _one_of(self, setting: str, allowed: tuple[str, ...]) -> None:
        if getattr(self, setting) not in allowed:
            raise UnknownNameError(f"{setting} of {self.name}", getattr(self, setting), allowed)

    def _otherwise(self, h: Hierarchy, x: Array, code: int, memory: Any = None) -> Resolution:
        """What follows a kernel's code other than SOLVED: more room, a refused row, a failure."""
        if code == TOO_SMALL:
            WORKSPACE.double()
            return self.solve(h, memory)
        if code < 0:
            refuse_inequality(self, h, -code - 1)
        return Resolution(x, Status(code))


def refuse_inequality(resolver: Resolver, h: Hierarchy, row: int) -> None:
    """Raise the HierarchyError that names the level and the row (of the whole stack) refused."""
    level = int((h.offsets[1:] <= row).sum())
    able = sorted(name for name, kind in _REGISTRY.items() if kind.handles == "inequalities")
    raise HierarchyError(
        f"{h.names[level]}, row {row - h.offsets[level]}: an inequality, {h.lower[row]:g} <= a x "
        f"<= {h.upper[row]:g}; {resolver.name} resolves {_RESOLVED[resolver.handles]}"
        f" (inequalities: {', '.join(able)})")


_REGISTRY: dict[str, type[Resolver]] = {}
_Kind = TypeVar("_Kind", bound=Resolver)


def register(kind: type[_Kind]) -> type[_Kind]:
    """Make a resolver known by its name."""
    _REGISTRY[kind.name] = kind
    return kind


def names() -> tuple[str, ...]:
    """Return the names of all resolvers, sorted."""
    return tuple(sorted(_REGISTRY))


def make(name: str, /, **settings: Any) -> Resolver:
    """Return the resolver called `name` with these settings, the rest at their defaults.

    Raises
    ------
    HierarchyError : no such resolver or setting, with the nearest that exists; a bad value.
    """
    if name not in _REGISTRY:
        raise UnknownNameError("resolver", name, _REGISTRY)
    kind = _REGISTRY[name]
    known = [field.name for field in dataclasses.fields(kind)]
    for setting in settings:
        if setting not in known:
            raise UnknownNameError(f"setting of {name}", setting, known)
    return kind(**settings)
