"""Work space that kernels write their intermediate numbers into.

Kernels allocate nothing: that costs them more than many of their sums. Each thread has one array,
made larger when a kernel says that it is TOO_SMALL; what is left in it from before never matters.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

import numpy as np

from hierarchy.problem import Array
from solvers.status import TOO_SMALL


class _Workspace(threading.local):
    """One array for each thread."""

    def __init__(self) -> None:
        self.array: Array = np.empty(4096)  # 32 kB: a humanoid's stack fits

    def double(self) -> None:
        """Make room for twice as many numbers."""
        self.array = np.empty(2 * self.array.size)


WORKSPACE = _Workspace()


def run(kernel: Callable[..., int], *arguments: Any) -> int:
    """Call a kernel with the work space behind its arguments, with more while that is too small."""
    code = kernel(*arguments, WORKSPACE.array)
    while code == TOO_SMALL:
        WORKSPACE.double()
        code = kernel(*arguments, WORKSPACE.array)
    return code
