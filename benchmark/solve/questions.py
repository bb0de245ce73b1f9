"""What a solver is asked about a problem: answers cold and warm, times, the same bits twice."""

import json
from functools import partial
from pathlib import Path
from time import process_time
from typing import Any, final

import numpy as np

from benchmark.solve.interface import Answer, Problem, Solver, read_problems
from benchmark.worker import Repeats, reason, timed


@final
class Questions:
    """The problems of a file, or those that were taken, asked one after the other."""

    def __init__(self, solver: type[Solver], options: dict[str, Any],
                 repeats: Repeats = Repeats()) -> None:  # noqa: B008
        self.solver, self.repeats = solver(**options), repeats
        self.version = self.solver.version
        self._file, self._ready = "", dict[str, Any]()
        self.take([])

    def take(self, problems: list[Problem], before: list[Problem | None] | None = None,
             sequence: bool = False) -> None:
        """Take problems, each with that of the tick before, if there is one and none is asked."""
        self.problems, self._sequence = problems, sequence
        self.before, self._answer = before or [None] * len(problems), (-1, None)

    def problem(self, file: str, p: int) -> dict[str, Any]:
        """Return the raw row of a problem of a file; a new file is read, and solved once untimed.

        The row has the memory where the file begins, and the processor time that it took [s].
        """
        begin = process_time()
        if file != self._file:
            with np.load(file, allow_pickle=False) as kept:
                sequence = bool(json.loads(kept["head.json"])["sequence"])
            self.take(read_problems(Path(file)), sequence=sequence)
            self._rehearse(self.problems[p])
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
            shorter = problem.without_last()
            if shorter is not None and not self.solver.refuses(shorter):
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
            earlier = self.before[p] or self.problems[p].moved(p)
            raw = self.solver.solve(self.solver.prepare(earlier))
        return None if getattr(raw, "memory", raw) is None else raw

    def _rehearse(self, problem: Problem) -> None:
        """Solve a problem, so that nothing is loaded or compiled while it is timed."""
        solver = self.solver
        try:
            if not solver.refuses(problem):
                raw = solver.solve(solver.prepare(problem))
                solver.inside(solver.prepare(problem), None, Repeats(1, 1))
                if solver.warm:
                    solver.solve_from(solver.prepare(problem), raw)
        except Exception:  # it is asked again, and what it raises is told
            return

    def _solved(self, problem: Problem) -> Answer:
        return self.solver.read(self.solver.solve(self.solver.prepare(problem)))

    def _timed(self, problem: Problem, before: Any = None) -> tuple[dict[str, Any], Any]:
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
