"""Work space for the intermediate results of kernels.

Kernels allocate no memory, since an allocation costs more than many of their loops. Each thread has
one array; it grows when a kernel returns TOO_SMALL. Its old contents never matter.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from hierarchy.problem import Array
from solvers.status import TOO_SMALL


class _Workspace(threading.local):
    """One array per thread."""

    def __init__(self) -> None:
        self.array: Array = np.empty(4096)  # 32 kB: enough for a humanoid's stack

    def double(self) -> None:
        """Make room for twice as many numbers."""
        self.array = np.empty(2 * self.array.size)


WORKSPACE = _Workspace()


def run(kernel: Callable[..., int], *arguments: Any) -> int:
    """Call a kernel with the work space as its last argument, growing it until it is large enough.

    arguments : whatever the kernel takes before the work space.
    """
    code = kernel(*arguments, WORKSPACE.array)
    while code == TOO_SMALL:
        WORKSPACE.double()
        code = kernel(*arguments, WORKSPACE.array)
    return code
