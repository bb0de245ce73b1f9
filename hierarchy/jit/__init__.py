"""How kernels are compiled, cached and called: the only place that knows the inside of numba."""

from hierarchy.jit.caching import cache_folder
from hierarchy.jit.compiling import compiled, inlined, unlocked
from hierarchy.jit.dispatching import bind
from hierarchy.jit.lanes import add_multiple as add_multiple
from hierarchy.jit.lanes import inner_product as inner_product
from hierarchy.jit.saying import announce_compilation
from hierarchy.jit.sources import Kernel as Kernel
from hierarchy.jit.views import as_integers as as_integers
from hierarchy.jit.views import as_matrix as as_matrix

__all__ = ["announce_compilation", "bind", "cache_folder", "compiled", "inlined", "unlocked"]
