"""The standard recursion with null-space projections."""

from dataclasses import dataclass
from typing import final

from hierarchy.errors import HierarchyError
from hierarchy.records import set_frozen
from solvers.kernels.recursion import recursion
from solvers.resolver import Direct, Resolver, number, one_of, register

_DAMPS = {"nakamura": "each level by its manipulability",
          "chiaverini": "the smallest singular direction of each level",
          "selective": "each singular direction of each level"}


@final
@register
@dataclass(frozen=True, kw_only=True)
class Recursive(Direct):
    """Level by level in the null space of the levels above, eqs. (5)-(6), (13) and (14).

    Damping applies to the pseudoinverse of (5), not to the projector (6).

    method : "level", the damping of `tpm`: x is then that of `tpm`, up to rounding; "nakamura", by
        manipulability, `threshold` is w_0; "chiaverini", numerical filtering of the smallest
        singular value; "selective", each singular direction has its own largest step.
        docs/theory/recursive.md has the equations and sources.
    isotropic : beta of "chiaverini", damping of all directions, in the unit of the rows.
    largest : gamma_max of "selective", in the unit of x; None is no damping. It ignores `damping`.
    """

    name = "recursive"
    kernel = staticmethod(recursion)
    method: str = one_of("level", *_DAMPS)  # in the order of `solvers.kernels.recursion`
    isotropic: float = number(0.0)
    largest: float | None = number(None, open_below=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        for setting, method in (("isotropic", "chiaverini"), ("largest", "selective")):
            if getattr(self, setting) and self.method != method:
                raise HierarchyError(f"recursive: {setting} = {getattr(self, setting)!r} goes with "
                                     f"method = {method!r}, not {self.method!r}")
        set_frozen(self, damps=_DAMPS.get(self.method, Resolver.damps))
