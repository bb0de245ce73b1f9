"""Work space for the intermediate results of kernels.

Kernels allocate no memory, since an allocation costs more than many of their loops. Each thread has
one array; it grows when a kernel returns TOO_SMALL. Its old contents never matter.
"""

import threading
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from hierarchy.jit import bind
from hierarchy.problem import Array
from solvers.status import TOO_SMALL


class _Workspace(threading.local):
    """One array per thread."""

    def __init__(self) -> None:
        self.array = _aligned(4096)  # 32 kB: enough for a humanoid's stack

    def double(self) -> None:
        """Make room for twice as many numbers."""
        self.array = _aligned(2 * self.array.size)


def _aligned(size: int) -> Array:
    """Return an array that begins with a line of the cache."""
    array = np.empty(size + 7)
    first = -array.ctypes.data // 8 % 8
    return array[first:first + size]


WORKSPACE = _Workspace()


@cache
def entry(kernel: Callable[..., int]) -> Callable[..., int]:
    """Return a kernel over a hierarchy as a function that does not look at the types of arguments.

    A call of it costs half (0.2 us less). The kernel takes A, lower, upper and sizes as a Hierarchy
    keeps them, then arrays of one dimension and of floats, each contiguous.
    """
    numbers, sizes = np.empty(0), np.empty(0, dtype=np.int64)
    further = getattr(kernel, "py_func", kernel).__code__.co_argcount - 4
    return bind(kernel, then=(np.empty((0, 0)), numbers, numbers, sizes, *(numbers,) * further))


def run(kernel: Callable[..., int], *arguments: Any) -> int:
    """Call a kernel with the work space as its last argument, growing it until it is large enough.

    arguments : whatever the kernel takes before the work space.
    """
    code = kernel(*arguments, WORKSPACE.array)
    while code == TOO_SMALL:
        WORKSPACE.double()
        code = kernel(*arguments, WORKSPACE.array)
    return code
