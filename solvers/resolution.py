"""`Resolution`: the result of a solve."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hierarchy.notebook import html_table, numbers
from hierarchy.problem import Array
from solvers.status import Status


class Resolution:
    """The result of a solve.

    Attributes
    ----------
    x : (n,) the answer, always finite.
    status : how the solve ended.
    iterations : number of iterations, counted in the resolver's own way; 1 for a direct resolver.
    memory : warm start for the next solve, in the resolver's own layout; None if it keeps none.
    witnesses : (K, n), for each level that gives an x of its least miss, see solvers.give; else
        None.
    """

    __slots__ = ("iterations", "memory", "status", "witnesses", "x")

    def __init__(self, x: Array, status: Status = Status.SOLVED, iterations: int = 1,
                 memory: Array | None = None) -> None:
        self.x = x
        self.status = status
        self.iterations = iterations
        self.memory = memory
        self.witnesses: Array | None = None

    @property
    def active(self) -> NDArray[np.int8] | None:
        """State of each row (m,), values of `solvers.status.Row`; None if it is not reported."""
        return None

    def __repr__(self) -> str:
        return (f"{type(self).__name__}({self.status.name}, x={numbers(self.x)}, "
                f"iterations={self.iterations})")

    def _repr_html_(self) -> str:
        rows = [("status", self.status), ("x", numbers(self.x)), ("iterations", self.iterations),
                ("memory", "none" if self.memory is None else f"{self.memory.size} numbers")]
        return html_table(type(self).__name__, (), rows)
