"""How kernels are compiled, cached and called: the only place that knows the inside of numba."""

from hierarchy.jit.binding import bind
from hierarchy.jit.compiling import (
    Kernel,
    as_integers,
    as_matrix,
    cache_folder,
    compiled,
    inlined,
    unlocked,
)

__all__ = ["Kernel", "as_integers", "as_matrix", "bind", "cache_folder", "compiled", "inlined",
           "unlocked"]
