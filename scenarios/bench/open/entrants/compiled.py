"""A solver in C++ behind a few functions of a shared library; see `shims/`.

void* prepare(int n, int levels, const long* sizes, const double* A, const double* lower,
const double* upper, const double* reference);  // reference: null if zero
int solve(void* prepared);                                    // 1 if it calls it solved
int solve_from(void* prepared, void* before);                 // optional
// Optional: writes times of repeated solves [ns], as shims/timed.h takes them; returns how many.
int solve_timed(void* prepared, const repeats* limits, long long* times);
int solve_from_timed(void* prepared, void* before, const repeats* limits, long long* times);
void answer(void* prepared, double* x, int* iterations);        // iterations: -1 if unknown
void release(void* prepared);
"""

from __future__ import annotations

import ctypes
from typing import Any, final

import numpy as np

from scenarios.bench.open.entrant import Answer, Entrant, Problem, Repeats

_VOID = ctypes.c_void_p


@final
class _Repeats(ctypes.Structure):
    _fields_ = (("least", ctypes.c_int), ("most", ctypes.c_int),
                ("turn", ctypes.c_longlong), ("enough", ctypes.c_longlong))


@final
class _Handle:
    """A prepared problem, released with the object; `solved` is what its last solve has said."""

    def __init__(self, library: ctypes.CDLL, problem: Problem) -> None:
        self.n, self.solved, self._library = len(problem.reference), False, library
        self._kept = [np.ascontiguousarray(values) for values in (
            problem.sizes, problem.A, problem.lower, problem.upper, problem.reference)]
        sizes, A, lower, upper, reference = (_VOID(values.ctypes.data) for values in self._kept)
        self.address = _VOID(library.prepare(
            self.n, len(problem.sizes), sizes, A, lower, upper,
            reference if problem.reference.any() else None))

    def __del__(self) -> None:
        self._library.release(self.address)


class Compiled(Entrant):
    """A library by its path, and what it says of itself."""

    def __init__(self, library: str, name: str, equalities: bool = False) -> None:
        self.library, self.name, self.equalities = ctypes.CDLL(library), name, equalities
        self.library.prepare.restype = _VOID
        self.warm = hasattr(self.library, "solve_from")

    def version(self) -> str:
        """Return the name that was given, with the version of the checkout."""
        return self.name

    def refuses(self, problem: Problem) -> str:
        """A kernel for equalities cannot be asked anything else."""
        return "equalities only" if self.equalities and not problem.is_equality else ""

    def prepare(self, problem: Problem) -> _Handle:
        """Copy the data into the solver's own form."""
        return _Handle(self.library, problem)

    def solve(self, prepared: _Handle) -> _Handle:
        """Solve from a cold start."""
        prepared.solved = bool(self.library.solve(prepared.address))
        return prepared

    def solve_from(self, prepared: _Handle, before: _Handle) -> _Handle:
        """Solve from the active set of an earlier answer."""
        prepared.solved = bool(self.library.solve_from(prepared.address, before.address))
        return prepared

    def inside(self, prepared: _Handle, before: _Handle | None, limits: Repeats) -> list[int]:
        """Let the library take the times, where it can."""
        name = "solve_timed" if before is None else "solve_from_timed"
        if not hasattr(self.library, name):
            return []
        times = np.zeros(limits.most, dtype=np.int64)
        start = [] if before is None else [before.address]
        count = getattr(self.library, name)(
            prepared.address, *start, ctypes.byref(_Repeats(*limits)), _VOID(times.ctypes.data))
        return [int(time) for time in times[:count]]

    def read(self, raw: Any) -> Answer:
        """Copy the answer."""
        x, iterations = np.zeros(raw.n), ctypes.c_int(-1)
        self.library.answer(raw.address, _VOID(x.ctypes.data), ctypes.byref(iterations))
        known = iterations.value if iterations.value >= 0 else None
        return Answer(x, raw.solved, known)
