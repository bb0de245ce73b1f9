"""The interface of every resolver: a name, frozen settings, `solve`, and the registry."""

from __future__ import annotations

import dataclasses
import functools
import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from contextlib import nullcontext
from functools import cached_property
from typing import Any, ClassVar, Literal, TypeVar, get_args

import numpy as np

from hierarchy import plugins
from hierarchy.errors import (
    HierarchyError,
    UnknownNameError,
    as_float,
    brief,
    check_name,
    expect,
    of_user,
    positive,
    whole,
)
from hierarchy.jit import announce_compilation
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from solvers.give import giving
from solvers.metric import in_metric
from solvers.resolution import Resolution as Resolution
from solvers.status import TOO_SMALL
from solvers.status import Status as Status
from solvers.workspace import WORKSPACE, entry

Handles = Literal["equalities", "bounds", "inequalities", "activations"]
_KINDS = get_args(Handles)
_CHECK, _CHOICES = "check", "choices"  # what a field says of a setting
_RESOLVED: dict[str, str] = {
    "equalities": "equalities only",
    "bounds": "equalities, and bounds on single unknowns in a first level of their own",
    "activations": "equalities, and rows that come with an activation"}


def number(default: Any = dataclasses.MISSING, low: float = 0.0, high: float = math.inf, *,
           open_below: bool = False) -> Any:
    """Return a field: a setting >= low, or > low if it is open below, and < high."""
    def check(resolver: Resolver, name: str, value: Any) -> None:
        if value is None and default is None:
            return
        found = as_float(value)
        if not low <= found < high or (open_below and found == low):
            below = "<" if float(f"{high:g}") == high else "<="  # the next number above a round one
            raise HierarchyError(f"{resolver.name}: {name} = {value!r}, expected a number "
                                 f"{'>' if open_below else '>='} {low:g} and {below} {high:g}")
        if type(value) is not float:
            set_frozen(resolver, **{name: found})

    return dataclasses.field(default=default, metadata={_CHECK: check})


def whole_number(default: int | None, least: int) -> Any:
    """Return a field: a setting that is a whole number >= least."""
    def check(resolver: Resolver, name: str, value: Any) -> None:
        if value is not None or default is not None:
            set_frozen(resolver, **{name: whole(f"{resolver.name}: {name}", value, least)})

    return dataclasses.field(default=default, metadata={_CHECK: check})


def one_of(*allowed: str) -> Any:
    """Return a field: a setting that is one of these, the first by default."""
    def check(resolver: Resolver, name: str, value: Any) -> None:
        check_name(f"{name} of {resolver.name}", value, allowed)

    return dataclasses.field(default=allowed[0], metadata={_CHECK: check, _CHOICES: allowed})


@functools.cache
def _checks(kind: type) -> list[tuple[str, Callable[..., None]]]:
    """Return the settings that a class declares above, each with its check.

    One that only gets another default in a subclass keeps the check.
    """
    return list({field.name: field.metadata[_CHECK] for base in reversed(kind.__mro__)
                 for field in vars(base).get("__dataclass_fields__", {}).values()
                 if _CHECK in field.metadata}.items())


@dataclasses.dataclass(frozen=True, kw_only=True)
class Resolver(ABC):
    """Abstract solver of a task hierarchy: an immutable record of its settings.

    Without damping every strict resolver gives the same x, `sns` while no bound acts. Damping has
    one meaning on equalities in `tpm`, `recursive`, `hcod`, `hqp` and `sns`; `damps` and
    `damps_with_bounds` name it, and what the others damp. Definitions:
    docs/theory/strict.md.

    damping : lambda_max of the variable damping near a singularity; 0 = off.
    threshold : singular value below which damping starts, in the unit of the rows.
    rank_tolerance : a row counts as dependent on the rows above it when the norm of what is left
        of it is at most rank_tolerance times its norm as given. The scale of a row does not matter.
        Less than 1e-14, which is rounding, is as much.

    Raises HierarchyError: a setting is not a number or is out of range.
    """

    damping: float = number(0.0)
    threshold: float = number(0.1, open_below=True)
    rank_tolerance: float = number(1e-8, high=1.0)

    name: ClassVar[str]
    handles: ClassVar[Handles] = "equalities"
    """Rows with lower < upper that the resolver accepts: none; bounds on single unknowns in a first
    level that has no other rows; or any. It rejects all others. "activations": rows that come with
    an activation, see solvers.resolvers.smooth."""
    strict: ClassVar[bool] = True
    """Whether priorities are respected exactly at any rank."""
    accuracy: ClassVar[float] = 1e-9
    """Expected error of x on a well-conditioned hierarchy, relative to 1 + |x|."""
    damps: ClassVar[str] = "each level"
    """What is damped in a stack of equalities. Strict resolvers with the same text find the same x.
    """
    damps_with_bounds: ClassVar[str] = ""
    """The same for a stack with inequalities; empty if the resolver handles none."""

    def __init_subclass__(cls, **options: Any) -> None:
        super().__init_subclass__(**options)
        if "solve" in vars(cls):
            solve = cls.solve if cls.__module__.startswith("solvers.") else _judged(cls.solve)
            cls.solve = _with_checks(solve)  # type: ignore[assignment,method-assign]

    def __post_init__(self) -> None:
        for name, check in _checks(type(self)):
            check(self, name, getattr(self, name))

    def __getstate__(self) -> dict[str, Any]:
        """Everything but what is worked out again when it is needed, such as compiled code."""
        return {name: value for name, value in vars(self).items() if not name.startswith("_")}

    def can_resolve(self, required: Handles) -> bool:
        """Whether the resolver accepts rows of the required kind."""
        check_name("kind of rows", required, _KINDS)
        both = required, self.handles
        return required in ("equalities", self.handles) or both == ("bounds", "inequalities")

    @property
    def label(self) -> str:
        """Name for tables and figures, with the choices that are not the default."""
        return " ".join([self.name, *(
            value for field in dataclasses.fields(self) if _CHOICES in field.metadata
            and (value := getattr(self, field.name)) != field.default)])

    @cached_property
    def _settings(self) -> Array:
        """All settings in one array, as declared: that is their order in the kernels.

        A choice is the number of what is chosen, and None stands for infinity.
        """
        values = [(field.metadata.get(_CHOICES), getattr(self, field.name))
                  for field in dataclasses.fields(self)]
        return np.array([math.inf if value is None else allowed.index(value) if allowed else value
                         for allowed, value in values], dtype=float)

    @abstractmethod
    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h, warm-started with the memory of an earlier resolution if there is one.

        Implementations get hierarchies without a metric: those with one come in the variables of
        `solvers.metric.in_metric`. None gives: see `solvers.give.giving`.

        Raises HierarchyError: the resolver cannot handle a row. A numerical outcome is a status.
        """

    def _solve_giving(self, h: Hierarchy, memory: Array | None) -> Resolution:
        """Resolve h, some levels of which give."""
        return giving(self.solve, h, h.giving, memory)

    def _otherwise(self, h: Hierarchy, x: Array, code: int,
                   memory: Array | None = None) -> Resolution:
        """Handle a kernel's code other than SOLVED: a small work space, a bad row, a failure."""
        if code == TOO_SMALL:
            WORKSPACE.double()
            return self.solve(h, memory)
        if code < 0:
            refuse_inequality(self, h, -code - 1)
        return Resolution(x, Status(code))


Solve = Callable[[Any, Hierarchy, Array | None], Resolution]
_ARRAY, _FLOAT = np.ndarray, np.dtype(np.float64)


def _judged(solve: Solve) -> Solve:
    """Return the `solve` of a plugin, whose result is looked at: it is the user's code."""
    @functools.wraps(solve)
    def judged(self: Any, h: Hierarchy, memory: Array | None = None) -> Resolution:
        found: Resolution = solve(self, h, memory)
        expect(f"resolver {self.name!r}: solve", found, Resolution, "return solvers.Resolution(x)")
        expect(f"resolver {self.name!r}: status", found.status, Status, "give one of Status")
        whole(f"resolver {self.name!r}: iterations", found.iterations)
        x = found.x
        if type(x) is not _ARRAY or x.dtype != _FLOAT or x.shape != (h.n,):
            raise HierarchyError(f"resolver {self.name!r}: solve: x: expected an array of {h.n} "
                                 f"floats, got {brief(x)}")
        if not np.isfinite(x).all():
            return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)
        found.x = x.copy()  # which it may keep, and overwrite with the next answer
        return found

    return judged


def _with_checks(solve: Solve) -> Solve:
    """Return `solve` for hierarchies with a metric too, with errors for arguments of wrong types.

    The hierarchy is judged after a failure, which costs a correct call next to nothing.
    """
    @functools.wraps(solve)
    def checked(self: Any, h: Hierarchy, memory: Array | None = None) -> Resolution:
        if memory is not None and (type(memory) is not _ARRAY or not (
                memory.dtype is _FLOAT or memory.dtype == _FLOAT)):  # `is` takes half the time
            raise HierarchyError(f"{self.name}: memory: got {brief(memory)}; give the memory of an "
                                 "earlier resolution, res.memory, or None")
        try:
            if h.plain:
                return solve(self, h, memory)
            if h.giving:
                refuse_give(self, h)
                found: Resolution = self._solve_giving(h, memory)
                return found
            if h.metric is not None:
                return in_metric(functools.partial(solve, self), h, memory)
            return solve(self, h, memory)
        except (AttributeError, TypeError):
            expect(f"{self.name}: h", h, Hierarchy,
                   "make one with Hierarchy.from_levels([(A, b), ...])")
            raise

    return checked


@dataclasses.dataclass(frozen=True)
class Direct(Resolver):
    """A resolver of equalities by one kernel, which needs no memory."""

    kernel: ClassVar[Callable[..., int]]

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h; a direct method that ignores `memory`."""
        x = h.start()
        A, lower, upper, sizes = h.rows
        code = entry(self.kernel)(A, lower, upper, sizes, x, self._settings, WORKSPACE.array)
        return self._otherwise(h, x, code) if code else Resolution(x)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Around(Resolver):
    """A resolver that answers through another, `inner`, and is called and judged as that one."""

    inner: Resolver

    def __post_init__(self) -> None:
        super().__post_init__()
        expect(f"{self.name}: inner", self.inner, Resolver, "give make('tpm')")
        set_frozen(self, strict=self.inner.strict, accuracy=self.inner.accuracy)

    @property
    def label(self) -> str:
        """The label of the inner resolver."""
        return self.inner.label


def place_of(h: Hierarchy, row: int) -> str:
    """Return the level and the row in it of a row, counted over all levels, for messages."""
    level = int((h.offsets[1:] <= row).sum())
    return f"{h.names[level]}, row {row - h.offsets[level]}"


def refuse_inequality(resolver: Resolver, h: Hierarchy, row: int) -> None:
    """Raise a HierarchyError that names the level and row of a row (counted over all levels)."""
    able = {handles: ", ".join(sorted(name for name, kind in _REGISTRY.items()
                                      if kind.handles == handles))
            for handles in ("inequalities", "bounds")}
    raise HierarchyError(
        f"{place_of(h, row)}: an inequality, {h.lower[row]:g} <= a x <= {h.upper[row]:g}; "
        f"{resolver.label} resolves {_RESOLVED[resolver.handles]}"
        f" (inequalities: {able['inequalities']}; bounds in a first level: {able['bounds']})")


def refuse_give(resolver: Resolver, h: Hierarchy) -> None:
    """Raise a HierarchyError, naming a level that gives, unless the resolver is strict with bounds.

    What gives becomes an inequality, and how far it gives is counted from the least miss.
    """
    if resolver.strict and resolver.handles == "inequalities":
        return
    able = ", ".join(sorted(name for name, kind in _REGISTRY.items()
                            if kind.handles == "inequalities" and kind().strict))
    raise HierarchyError(f"{h.names[h.giving[0]]}: it gives, which needs strict levels of "
                         f"inequalities; {resolver.label} has none ({able})")


_REGISTRY: dict[str, type[Resolver]] = {}
_VARIANTS: dict[str, tuple[str, dict[str, Any]]] = {}  # a resolver with settings, by its own name
_Kind = TypeVar("_Kind", bound=Resolver)


def register(kind: type[_Kind]) -> type[_Kind]:
    """Register a class of resolvers under its name; HierarchyError if that is taken."""
    _check(kind)
    plugins.register("resolvers", kind.name, shipped=kind.__module__.startswith("solvers."))(kind)
    _REGISTRY[kind.name] = kind
    return kind


def _check(kind: type[Resolver]) -> None:
    """Raise a HierarchyError for what a class of resolvers says of itself and is not so."""
    what = f"resolver {kind.__name__}"
    expect(f"{what}: name", getattr(kind, "name", None), str, "give it a name")
    check_name(f"kind of rows that {kind.name} handles", kind.handles, _KINDS)
    positive(f"{what}: accuracy", kind.accuracy)
    expect(f"{what}: strict", kind.strict, bool, "say whether priorities are")


def register_variant(name: str, resolver: str, **settings: Any) -> None:
    """Register a resolver with these settings under a name of its own."""
    _VARIANTS[name] = resolver, settings


def variants() -> dict[str, str]:
    """Return the spec of each named variant, such as "tpm-published", sorted by name."""
    return {name: ":".join((resolver, *(f"{key}={value}" for key, value in settings.items())))
            for name, (resolver, settings) in sorted(_VARIANTS.items())}


def names() -> tuple[str, ...]:
    """Return the names of all resolvers that need nothing beside a hierarchy, sorted."""
    return tuple(sorted(name for name, kind in _REGISTRY.items() if kind.handles != "activations"))


def _find_elsewhere(name: str) -> None:
    """Register the resolver that a plugin has under a name; UnknownNameError if there is none."""
    found = plugins.find("resolvers", name)
    if name not in _REGISTRY:  # a plugin may have used `register` of this module
        if found is None:
            known = {*_REGISTRY, *_VARIANTS, *plugins.own("resolvers")}
            raise UnknownNameError("resolver", name, known)
        if not (isinstance(found, type) and issubclass(found, Resolver)):
            raise HierarchyError(f"resolver {name!r} of a plugin: expected a class of Resolver, "
                                 f"got {brief(found)}")
        _check(found)
        _REGISTRY[name] = found


def make(name: str, /, **settings: Any) -> Resolver:
    """Return the resolver called `name` with these settings and defaults for the rest.

    Raises HierarchyError: no such resolver or setting (suggests the nearest), or an invalid value.
    """
    expect("make", name, str, "give one of solvers.names()")
    if name in _VARIANTS:
        resolver, own = _VARIANTS[name]
        return make(resolver, **own | settings)
    if name not in _REGISTRY:
        _find_elsewhere(name)
    announce_compilation()
    kind = _REGISTRY[name]
    known = [field.name for field in dataclasses.fields(kind)]
    for setting in settings:
        check_name(f"setting of {name}", setting, known)
    with nullcontext() if kind.__module__.startswith("solvers.") else of_user(f"resolver {name!r}"):
        return kind(**settings)
