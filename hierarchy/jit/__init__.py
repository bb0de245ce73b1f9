"""How kernels are compiled, cached and called: the only place that knows the inside of numba."""

from hierarchy.jit.binding import bind
from hierarchy.jit.compiling import Kernel as Kernel
from hierarchy.jit.compiling import (
    announce_compilation,
    cache_folder,
    compiled,
    inlined,
    unlocked,
)
from hierarchy.jit.compiling import as_integers as as_integers
from hierarchy.jit.compiling import as_matrix as as_matrix
from hierarchy.jit.lanes import inner_product as inner_product

__all__ = ["announce_compilation", "bind", "cache_folder", "compiled", "inlined", "unlocked"]
