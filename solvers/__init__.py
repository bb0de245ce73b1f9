"""How a hierarchy is resolved: many resolvers behind one interface.

`solve_ik`, which needs a robot, is imported when first used: a program that has only arrays does
not load pinocchio.
"""

from typing import TYPE_CHECKING, Any

from solvers import resolvers as resolvers
from solvers.certificate import Certificate, certify
from solvers.explain import explain
from solvers.resolver import Resolution, Resolver, make, names, variants
from solvers.status import Status

if TYPE_CHECKING:
    from solvers.ik import solve_ik

__all__ = ["Certificate", "Resolution", "Resolver", "Status", "certify", "explain", "make", "names",
           "solve_ik", "variants"]


def __getattr__(name: str) -> Any:
    if name != "solve_ik":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from solvers.ik import solve_ik

    globals()[name] = solve_ik
    return solve_ik


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
