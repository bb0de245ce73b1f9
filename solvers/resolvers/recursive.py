"""The standard recursion with null-space projections."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf
from typing import ClassVar, final

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.problem import Array, Hierarchy
from hierarchy.records import set_frozen
from solvers.kernels.damped import CHIAVERINI, LEVEL, NAKAMURA, SELECTIVE
from solvers.kernels.recursion import recursion
from solvers.resolver import Resolution, Resolver, register
from solvers.workspace import WORKSPACE, entry

_METHODS = {"level": LEVEL, "nakamura": NAKAMURA, "chiaverini": CHIAVERINI,
            "selective": SELECTIVE}
_DAMPS = {"nakamura": "each level by its manipulability",
          "chiaverini": "the smallest singular direction of each level",
          "selective": "each singular direction of each level"}


@final
@register
@dataclass(frozen=True, kw_only=True)
class Recursive(Resolver):
    """Level by level in the null space of the levels above, eqs. (5)-(6), (13) and (14).

    Damping applies to the pseudoinverse of (5), not to the projector (6).

    method : "level", the damping of `tpm`: x is then that of `tpm`, up to rounding; "nakamura", by
        manipulability, `threshold` is w_0; "chiaverini", numerical filtering of the smallest
        singular value; "selective", each singular direction has its own largest step.
        docs/theory/recursive.md has the equations and sources.
    isotropic : beta of "chiaverini", damping of all directions, in the unit of the rows.
    largest : gamma_max of "selective", in the unit of x; None is no damping. It ignores `damping`.
    """

    name: ClassVar[str] = "recursive"
    method: str = "level"
    isotropic: float = 0.0
    largest: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self._one_of("method", tuple(_METHODS))
        self._number("isotropic", 0.0, inf)
        if self.largest is not None:
            self._number("largest", 0.0, inf, open_below=True)
        for setting, method in (("isotropic", "chiaverini"), ("largest", "selective")):
            if getattr(self, setting) and self.method != method:
                raise HierarchyError(f"recursive: {setting} = {getattr(self, setting)!r} goes with "
                                     f"method = {method!r}, not {self.method!r}")
        set_frozen(self, damps=_DAMPS.get(self.method, Resolver.damps))

    @property
    def label(self) -> str:
        """`recursive`, and the method if it is not the default."""
        return self.name + ("" if self.method == "level" else f" {self.method}")

    @cached_property
    def _settings(self) -> Array:
        return np.array([self.damping, self.threshold, self.rank_tolerance,
                         _METHODS[self.method], self.isotropic,
                         inf if self.largest is None else self.largest])

    def solve(self, h: Hierarchy, memory: Array | None = None) -> Resolution:
        """Resolve h; a direct method that ignores `memory`."""
        x = h.start()
        A, lower, upper, sizes = h.rows
        code = entry(recursion)(A, lower, upper, sizes, x, self._settings, WORKSPACE.array)
        return self._otherwise(h, x, code, memory) if code else Resolution(x)
