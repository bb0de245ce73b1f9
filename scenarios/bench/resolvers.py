"""Time and error of every resolver of equalities on the reference problems, beside plain numpy."""

from __future__ import annotations

import csv
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter_ns
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from hierarchy.problem import Hierarchy
from scenarios.bench.families import DATA, Problem, family
from scenarios.bench.families import EQUALITIES as FAMILIES
from solvers import Resolution, Status, make, names

_SOLVED_TO = 1e-6  # a level's violation off by more than this is a failure


def plain_numpy(h: Hierarchy) -> Resolution:
    """Solve by the recursion (5), (6), (14) as one writes it with np.linalg.pinv."""
    x, P = np.zeros(h.n), np.eye(h.n)
    for first, last in zip(h.offsets[:-1], h.offsets[1:], strict=True):
        J, b = h.A[first:last], h.lower[first:last]
        inverse = np.linalg.pinv(J @ P, rcond=1e-9)
        x = x + inverse @ (b - J @ x)
        P = P - inverse @ (J @ P)
    return Resolution(x + P @ h.reference)


@dataclass
class _Candidate:
    label: str
    solve: Callable[[Hierarchy], Resolution]
    times: list[int] = field(default_factory=list)  # [ns]
    failures: int = 0
    error: float = 0.0

    def judge(self, problem: Problem) -> None:
        """Solve once, untimed, and compare the violations with the certified ones."""
        res = self.solve(problem.h)
        error = float(np.abs(problem.h.violations(res.x) - problem.norms).max())
        self.error = max(self.error, error)
        self.failures += res.status is not Status.SOLVED or error > _SOLVED_TO

    def time(self, h: Hierarchy) -> None:
        start = perf_counter_ns()
        self.solve(h)
        self.times.append(perf_counter_ns() - start)


def candidates() -> list[Any]:
    """Every resolver in its forms; those that live on inequalities solve equalities too."""
    return [*(make(name) for name in names()), make("tpm", form="published")]


def run(out: Path | None = None, seconds: float = 2.0, folder: Path = DATA) -> list[dict[str, Any]]:
    """Time all resolvers on the equality families, and a plain numpy recursion among them.

    The candidates take turns problem by problem, so that the machine's noise hits all of them
    alike; a warm-up round judges the answers. Times are of `solve` called from Python. Prints a
    table, writes resolvers.csv into `out` if given, and returns its rows.

    seconds : [s] of timing a family.
    folder : where the families are.

    Raises
    ------
    HierarchyError : a family's file is not in the folder.
    """
    families = {name: family(name, folder) for name in FAMILIES}
    rows = [row for name, problems in families.items()
            for row in _run_family(name, problems, seconds)]
    _print(rows)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        with (out / "resolvers.csv").open("w", newline="") as file:
            writer = csv.DictWriter(file, list(rows[0]))
            writer.writeheader()
            writer.writerows(rows)
    return rows


def _run_family(name: str, problems: list[Problem], seconds: float) -> list[dict[str, Any]]:
    plain = _Candidate("plain numpy", plain_numpy)
    field_of = [plain, *(_Candidate(r.label, r.solve) for r in candidates())]
    for problem in problems:
        for candidate in field_of:
            candidate.judge(problem)
    stop = perf_counter_ns() + int(seconds * 1e9)
    while not plain.times or perf_counter_ns() < stop:
        for problem in problems:
            for candidate in field_of:
                candidate.time(problem.h)
    slow = float(np.median(plain.times))
    return [_row(name, candidate, len(problems), slow) for candidate in field_of]


def _row(name: str, candidate: _Candidate, count: int, slow: float) -> dict[str, Any]:
    median, p95, p999 = np.percentile(candidate.times, [50, 95, 99.9])
    return {"family": name, "resolver": candidate.label, "problems": count,
            "solves": len(candidate.times), "median_us": median / 1e3, "p95_us": p95 / 1e3,
            "p99.9_us": p999 / 1e3, "failures": candidate.failures,
            "largest_error": candidate.error, "times_faster_than_numpy": slow / median}


_COLUMNS = {"family": "family", "resolver": "resolver", "median_us": "median", "p95_us": "p95",
            "p99.9_us": "p99.9", "failures": "failed", "largest_error": "error",
            "times_faster_than_numpy": "x numpy"}


def _print(rows: list[dict[str, Any]]) -> None:
    table = Table(title="Resolvers on reference problems: solve() from Python [us]")
    for column, header in _COLUMNS.items():
        text = column in ("family", "resolver")
        table.add_column(header, justify="left" if text else "right", no_wrap=True)
    for row in rows:
        values = [row[column] for column in _COLUMNS]
        table.add_row(*(f"{value:.3g}" if isinstance(value, float) else str(value)
                        for value in values), end_section=row is _last_of(rows, row["family"]))
    Console().print(table)
    Console().print("failed: of the problems, not solved or a level's violation off by more than "
                    f"{_SOLVED_TO:g}; augmented and tpm published are not strict at every rank")


def _last_of(rows: list[dict[str, Any]], name: str) -> dict[str, Any]:
    return [row for row in rows if row["family"] == name][-1]
