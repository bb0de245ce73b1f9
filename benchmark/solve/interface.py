"""What a solver is to the benchmark, and what it is asked about a problem.

A solver is one class in one file: docs/extending/entrant.md shows one. It is asked for answers cold
and warm, times, and the same bits twice. Needs only numpy, as `hierarchy.problem` does, since any
environment may run it.
"""

import json
from functools import partial
from importlib.metadata import version
from pathlib import Path
from time import process_time
from typing import Any, NamedTuple, final

import numpy as np
from numpy.typing import NDArray

from benchmark.worker import Repeats, reason, timed
from hierarchy.problem import Array, Hierarchy

_MOVED = 0.01  # relative change of the sides between a problem and the one solved before it


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

    def refuses(self, problem: Hierarchy) -> str:
        """Return why a problem is not of the class that the solver can be asked, or ""."""
        return ""

    def prepare(self, problem: Hierarchy) -> Any:
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


def shifted(h: Hierarchy) -> Hierarchy:
    """Return the problem of x - reference, for solvers that know no reference."""
    by = h.A @ h.reference
    return h.changed(lower=h.lower - by, upper=h.upper - by, reference=None)


def moved(h: Hierarchy, rng: np.random.Generator) -> Hierarchy:
    """Return the problem with both sides of each row changed by a factor within 1 % of 1."""
    factor = 1.0 + _MOVED * rng.uniform(-1.0, 1.0, h.m)
    return h.changed(lower=h.lower * factor, upper=h.upper * factor)


def read_problems(file: Path) -> list[Hierarchy]:
    """Return the problems of a file; docs/problem-files.md describes it."""
    with np.load(file, allow_pickle=False) as kept:
        n = kept["n"]
        sizes = _parts(kept["sizes"], kept["levels"])
        m = np.array([own.sum() for own in sizes], dtype=np.int64)
        return [Hierarchy(A.reshape(-1, len(reference)), lower, upper, own, reference)
                for A, lower, upper, own, reference in zip(
                    _parts(kept["A"], m * n), _parts(kept["lower"], m), _parts(kept["upper"], m),
                    sizes, _parts(kept["reference"], n), strict=True)]


def _parts(values: NDArray[Any], counts: NDArray[np.int64]) -> list[NDArray[Any]]:
    """Return copies of successive parts of these lengths."""
    return [part.copy() for part in np.split(values, np.cumsum(counts))[:-1]]


@final
class Questions:
    """The problems of a file, or those that were taken, asked one after the other."""

    def __init__(self, solver: type[Solver], options: dict[str, Any],
                 repeats: Repeats = Repeats()) -> None:  # noqa: B008
        self.solver, self.repeats = solver(**options), repeats
        self.version = self.solver.version
        self._file, self._ready = "", dict[str, Any]()
        self.take([])

    def take(self, problems: list[Hierarchy], before: list[Hierarchy | None] | None = None,
             sequence: bool = False) -> None:
        """Take problems, each with that of the tick before, if there is one and none is asked."""
        self.problems, self._sequence = problems, sequence
        self.before, self._answer = before or [None] * len(problems), (-1, None)

    def problem(self, file: str, p: int) -> dict[str, Any]:
        """Return the raw row of a problem of a file; a new file is read, and asked once before.

        The row has the memory where the file begins, and the processor time that it took [s].
        """
        begin = process_time()
        if file != self._file:
            with np.load(file, allow_pickle=False) as kept:
                sequence = bool(json.loads(kept["head.json"])["sequence"])
            self.take(read_problems(Path(file)), sequence=sequence)
            self.asked(p)  # loads and compiles
            self._file, self._ready = file, {"start_kib": resident()}
        return {**self._ready, **self.asked(p), "busy_s": process_time() - begin}

    def asked(self, p: int) -> dict[str, Any]:
        """Return the answers to a problem that was taken, and what was measured."""
        problem = self.problems[p]
        refusal = self.solver.refuses(problem)
        if refusal:
            return {"refused": refusal}
        try:
            said, raw = self._timed(problem)
            x, again = said["x"], self._solved(problem)
            said["same"] = bool(np.array_equal(x, again.x, equal_nan=True))
            full = np.flatnonzero(problem.sizes)
            if len(full) > 1 and not self.solver.refuses(
                    shorter := problem.upper_part(int(full[-1]))):
                answer = self._solved(shorter)
                said["without"] = answer.x.tolist() if answer.solved else None
            if self.solver.warm and (start := self._start(p)) is not None:
                more, raw = self._timed(problem, start)
                said |= more
            self._answer = p, raw
        except Exception as error:
            return {"raised": reason(error)}
        return {**said, "rss_kib": resident()}

    def _start(self, p: int) -> Any:
        """Return the solver's own answer that a warm start begins with, None without one."""
        if self._sequence:
            asked, raw = self._answer
            raw = raw if asked == p - 1 else None
        else:
            earlier = self.before[p] or moved(self.problems[p], np.random.default_rng(p))
            raw = self.solver.solve(self.solver.prepare(earlier))
        return None if getattr(raw, "memory", raw) is None else raw

    def _solved(self, problem: Hierarchy) -> Answer:
        return self.solver.read(self.solver.solve(self.solver.prepare(problem)))

    def _timed(self, problem: Hierarchy, before: Any = None) -> tuple[dict[str, Any], Any]:
        """Solve from a cold start, or an earlier answer; return the row, and the solver's own."""
        solver, prepared = self.solver, self.solver.prepare(problem)
        start, prefix = ("cold", "") if before is None else ("warm", "warm_")
        times, raw = timed(partial(solver.solve, prepared) if before is None else
                           partial(solver.solve_from, prepared, before), self.repeats)
        x, solved, iterations = solver.read(raw)
        return {f"{prefix}solved": bool(solved), f"{prefix}x": np.asarray(x, dtype=float).tolist(),
                f"{prefix}iterations": iterations, f"{start}_ns": times[1:] or times,
                f"{start}_inside_ns": solver.inside(prepared, before, self.repeats)}, raw


def resident() -> int:
    """Return the largest memory that this process has had so far [KiB]; 0 if it is not known."""
    about = Path("/proc/self/status")  # getrusage counts what the parent had before
    lines = about.read_text().splitlines() if about.is_file() else []
    return next((int(line.split()[1]) for line in lines if line.startswith("VmHWM:")), 0)
