"""The quadratic programming solvers that `hqp` calls through qpsolvers, and their accuracy."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Any, final

from hierarchy.errors import HierarchyError, check_name


@final
@dataclass(frozen=True)
class Backend:
    """A solver, how to call it, and its required accuracy.

    name : its name in qpsolvers.
    module : the module to import; from the package's dependencies or its extra `qp`.
    accuracy : of x, relative to 1 + |x|; an answer that is not shown to reach it is not used.
    options : its tolerances, passed on by qpsolvers.
    insisting : options added for a second call if the first finds a program infeasible: none is.
    sparse : whether it needs sparse matrices.
    halved : whether it reads the upper half of the Hessian, and is slow to cut off the other.
    scaled : whether it gets unknowns of order one, as its tolerances are not relative to them.
    regularisation : added to the diagonal of the Hessian, for solvers that need a definite one.
    starts : whether it accepts an initial guess.
    core : whether it is installed with the package; otherwise with the extra.
    """

    name: str
    module: str
    accuracy: float
    options: Mapping[str, Any]
    insisting: Mapping[str, Any] | None = None
    sparse: bool = False
    halved: bool = False
    scaled: bool = True
    regularisation: float = 0.0
    starts: bool = False
    core: bool = False


BACKENDS: Mapping[str, Backend] = MappingProxyType({backend.name: backend for backend in (
    Backend("proxqp", "proxsuite", 1e-6, {"eps_abs": 1e-9, "eps_rel": 0.0, "max_iter": 1000},
            {"primal_infeasibility_solving": True}, starts=True, core=True),
    Backend("osqp", "osqp", 1e-5, {"eps_abs": 1e-7, "eps_rel": 1e-7, "max_iter": 20000},
            sparse=True, halved=True, scaled=False, starts=True, core=True),
    Backend("quadprog", "quadprog", 1e-6, {}, regularisation=1e-9),
    Backend("daqp", "daqp", 1e-6, {"primal_tol": 1e-9}, regularisation=1e-9, starts=True),
    Backend("piqp", "piqp", 1e-6, {"eps_abs": 1e-9, "eps_rel": 0.0}),
    Backend("clarabel", "clarabel", 1e-6,
            {"tol_gap_abs": 1e-10, "tol_gap_rel": 1e-10, "tol_feas": 1e-10}, sparse=True),
)})


def backend_of(name: str) -> Backend:
    """Return the backend of that name.

    Raises
    ------
    UnknownNameError : no such backend.
    HierarchyError : it is not installed; names the package or extra to install.
    """
    check_name("backend of hqp", name, BACKENDS)
    backend = BACKENDS[name]
    if not installed(name):
        extra = "scenarios" if backend.core else "qp"
        raise HierarchyError(f"hqp: backend {name!r} is not installed; "
                             f"pip install 'task-hierarchy[{extra}]'")
    return backend


@cache
def installed(name: str) -> bool:
    """Whether a backend can be imported."""
    # osqp, which qpsolvers imports, otherwise looks for builds with MKL and CUDA at every program.
    os.environ.setdefault("OSQP_ALGEBRA_BACKEND", "builtin")
    try:
        import_module(BACKENDS[name].module)
    except ImportError:
        return False
    return True
