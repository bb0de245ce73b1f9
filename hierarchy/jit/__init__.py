"""How kernels are compiled, cached and called: the only place that knows the inside of numba."""

from hierarchy.jit.caching import cache_folder
from hierarchy.jit.compiling import bind, compiled, inlined, internal, unlocked
from hierarchy.jit.intrinsics import add_multiple as add_multiple
from hierarchy.jit.intrinsics import as_integers as as_integers
from hierarchy.jit.intrinsics import as_matrix as as_matrix
from hierarchy.jit.intrinsics import inner_product as inner_product
from hierarchy.jit.saying import announce_compilation
from hierarchy.jit.sources import Kernel as Kernel

__all__ = ["announce_compilation", "bind", "cache_folder", "compiled", "inlined",
           "internal", "unlocked"]
