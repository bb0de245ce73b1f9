"""A solver in a shared library that has the functions of solver.h."""

import ctypes
import hashlib
import sys
from pathlib import Path
from typing import Any, final
from weakref import finalize

import numba
import numpy as np

from benchmark.solve.interface import Answer, Solver
from benchmark.worker import Repeats
from hierarchy.problem import Array, Hierarchy

_VOID = ctypes.c_void_p
_PASSED, _BUSY = 1, 2  # clocks of Linux: monotonic, and processor time of this process


@final
class _Handle:
    """A prepared problem, released with the object, and what its last solve has said."""

    def __init__(self, library: ctypes.CDLL, problem: Hierarchy) -> None:
        kept = [np.ascontiguousarray(values) for values in (
            problem.sizes, problem.A, problem.lower, problem.upper, problem.reference)]
        self.x, self.iterations = np.zeros(len(problem.reference)), np.array([-1])
        self.solved = False
        self.address = library.prepare(len(self.x), len(problem.sizes),
                                       *(values.ctypes.data for values in kept))
        if self.address:
            finalize(self, library.release, self.address)


@final
class Compiled(Solver):
    """A library by its path, and the name that the user gives it."""

    warm = True

    def __init__(self, library: str, name: str) -> None:
        digest = hashlib.sha256(Path(library).read_bytes()).hexdigest()[:12]
        self.name, self.library = f"{name}, SHA-256 {digest}", ctypes.CDLL(library)
        self.library.prepare.restype = _VOID
        self.library.prepare.argtypes = [ctypes.c_int64, ctypes.c_int64, *[_VOID] * 5]
        self.library.solve.argtypes = [_VOID] * 4
        self.library.release.argtypes = [_VOID]
        self._timed = _loop(self.library.solve) if sys.platform == "linux" else None

    def version(self) -> str:
        """Return the name that was given, and what the file is: archives have no version."""
        return self.name

    def refuses(self, problem: Hierarchy) -> str:
        """`prepare` returns no handle."""
        return "" if _Handle(self.library, problem).address else "not for this solver"

    def prepare(self, problem: Hierarchy) -> _Handle:
        """Let the library copy the data into its own form."""
        return _Handle(self.library, problem)

    def solve(self, prepared: _Handle) -> _Handle:
        """Solve from a cold start."""
        return self.solve_from(prepared, None)

    def solve_from(self, prepared: _Handle, before: _Handle | None) -> _Handle:
        """Solve from an earlier answer."""
        prepared.solved = bool(self.library.solve(
            prepared.address, before.address if before else None, prepared.x.ctypes.data,
            prepared.iterations.ctypes.data))
        return prepared

    def inside(self, prepared: _Handle, before: _Handle | None, repeats: Repeats) -> list[int]:
        """Take the times in a compiled loop, without the call from Python."""
        if self._timed is None:
            return []
        times = np.zeros(repeats.most, dtype=np.int64)
        count = self._timed(prepared.address, before.address if before else 0, prepared.x,
                            prepared.iterations, np.array(repeats), times)
        return [int(time) for time in times[:count]]

    def read(self, raw: _Handle) -> Answer:
        """Copy the answer."""
        known = int(raw.iterations[0]) if raw.iterations[0] >= 0 else None
        return Answer(raw.x.copy(), raw.solved, known)


def _loop(solve: Any) -> Any:
    """Return a compiled function that solves and takes times as `benchmark.worker.timed` does."""
    clock = ctypes.CDLL(None).clock_gettime
    clock.argtypes, clock.restype = [ctypes.c_int, _VOID], ctypes.c_int

    @numba.njit  # type: ignore[untyped-decorator]
    def now(which: int, moment: Array) -> int:
        clock(which, moment.ctypes.data)
        return moment[0] * 1_000_000_000 + moment[1]  # type: ignore[no-any-return]

    @numba.njit  # type: ignore[untyped-decorator]
    def times_of(prepared: int, before: int, x: Array, iterations: Array, repeats: Array,
                 times: Array) -> int:
        least, most, turn, enough = repeats
        moment, count = np.zeros(2, dtype=np.int64), 0
        begin = now(_PASSED, moment)
        while count == 0 or (count < most and now(_PASSED, moment) - begin < (
                enough if count < least else turn)):
            busy, start = now(_BUSY, moment), now(_PASSED, moment)
            solve(prepared, before, x.ctypes.data, iterations.ctypes.data)
            passed = now(_PASSED, moment) - start
            times[count] = min(passed, now(_BUSY, moment) - busy)
            count += 1
        return count

    return times_of
