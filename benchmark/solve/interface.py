"""What a solver is to the benchmark. Needs only numpy, since any environment may run it.

A solver is one class in one file: docs/extending/entrant.md shows one.
"""

from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, Self, final

import numpy as np
from numpy.typing import NDArray

from benchmark.worker import Repeats

Array = NDArray[np.float64]
_MOVED = 0.01  # relative change of the sides between a problem and the one solved before it


@final
@dataclass(frozen=True)
class Problem:
    """Levels of rows lower <= A x <= upper, most important first; missing sides are infinite.

    A : (m, n), C-contiguous. lower, upper : (m,). sizes : (L,) rows of each level. reference : (n,)
    the x preferred where the levels leave freedom.
    """

    A: Array
    lower: Array
    upper: Array
    sizes: NDArray[np.int64]
    reference: Array

    @property
    def is_equality(self) -> bool:
        """Whether every row is an equality."""
        return bool((self.lower == self.upper).all())

    @property
    def ends(self) -> NDArray[np.int64]:
        """Row after the last of each level: (L,)."""
        return np.cumsum(self.sizes)

    def without_last(self) -> Self | None:
        """Return the problem without its last level that has rows; None if there is only one."""
        full = np.flatnonzero(self.sizes)
        if len(full) < 2:
            return None
        m = int(self.ends[full[-1] - 1])
        return replace(self, A=self.A[:m].copy(), lower=self.lower[:m].copy(),
                       upper=self.upper[:m].copy(), sizes=self.sizes[:full[-1]].copy())

    def shifted(self) -> Self:
        """Return the problem of x - reference, for solvers that know no reference."""
        by = self.A @ self.reference
        return replace(self, lower=self.lower - by, upper=self.upper - by,
                       reference=np.zeros(len(self.reference)))

    def moved(self, seed: int) -> Self:
        """Return the problem with both sides of each row changed by a factor within 1 % of 1."""
        factor = 1.0 + _MOVED * np.random.default_rng(seed).uniform(-1.0, 1.0, len(self.A))
        return replace(self, lower=self.lower * factor, upper=self.upper * factor)


class Answer(NamedTuple):
    """What an entrant says: x (n,), whether it calls it solved, and its iterations if it knows."""

    x: Array
    solved: bool
    iterations: int | None = None


class Solver:
    """A solver. Only `solve` and `solve_from` are timed.

    warm : whether `solve_from` starts from an earlier answer. package : whose version it has.
    """

    warm = False
    package = ""

    def version(self) -> str:
        """Return name and version of the package."""
        return f"{self.package} {version(self.package)}"

    def refuses(self, problem: Problem) -> str:
        """Return why a problem is not of the class that the solver can be asked, or ""."""
        return ""

    def prepare(self, problem: Problem) -> Any:
        """Return the problem in the solver's own form."""
        return problem

    def solve(self, prepared: Any) -> Any:
        """Return the solver's own answer to a prepared problem, from a cold start."""
        raise NotImplementedError

    def solve_from(self, prepared: Any, before: Any) -> Any:
        """Return the same, started from the solver's own answer to the problem before."""
        raise NotImplementedError

    def inside(self, prepared: Any, before: Any, limits: Repeats) -> list[int]:
        """Return times [ns] of solves taken inside a compiled package, [] if it cannot take them.

        before : None for a cold start, or else what `solve_from` is given.
        """
        return []

    def read(self, raw: Any) -> Answer:
        """Return the solver's own answer as an Answer."""
        raise NotImplementedError


def read_problems(file: Path) -> list[Problem]:
    """Return the problems of a file; docs/problem-files.md describes it."""
    with np.load(file, allow_pickle=False) as kept:
        n = kept["n"]
        sizes = _parts(kept["sizes"], kept["levels"])
        m = np.array([own.sum() for own in sizes], dtype=np.int64)
        return [Problem(A.reshape(len(lower), -1 if len(lower) else len(reference)), lower, upper,
                        own, reference)
                for A, lower, upper, own, reference in zip(
                    _parts(kept["A"], m * n), _parts(kept["lower"], m), _parts(kept["upper"], m),
                    sizes, _parts(kept["reference"], n), strict=True)]


def _parts(values: NDArray[Any], counts: NDArray[np.int64]) -> list[NDArray[Any]]:
    """Return copies of successive parts of these lengths."""
    return [part.copy() for part in np.split(values, np.cumsum(counts))[:-1]]
