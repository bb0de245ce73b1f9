"""Growth of the time of a solve with the numbers of tasks and joints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import perf_counter, perf_counter_ns
from typing import Any, final

import numpy as np
from rich.console import Console

from hierarchy.problem import Hierarchy
from scenarios.bench.accuracy import entrants
from scenarios.bench.machine import one_core
from scenarios.bench.rows import table_of_numbers

TASKS = tuple((30, count) for count in range(1, 11))              # (joints, tasks)
JOINTS = tuple((n, 5) for n in (20, 30, 45, 70, 100, 150, 200, 300))
ROWS = 3                # per task
FITTED = 3              # smallest number of upper sizes for fitting an exponent
LEVEL_LESS = ("augmented", "weighted")  # not timed: no priorities
_TURN = 1_000_000       # [ns] of timing per turn
_MOST = 20              # solves in a turn


@final
@dataclass
class Timed:
    """One resolver at one size: its call, and its times [ns] so far."""

    resolver: str
    joints: int
    tasks: int
    call: Callable[[], Any]
    times: list[int] = field(default_factory=list)

    def take_turn(self) -> None:
        """Call once untimed, for the caches, then for a millisecond or 20 times."""
        self.call()
        begin = perf_counter_ns()
        for _ in range(_MOST):
            start = perf_counter_ns()
            self.call()
            end = perf_counter_ns()
            self.times.append(end - start)
            if end - begin > _TURN:
                break

    def row(self, figure: str) -> dict[str, Any]:
        """Return the row of the table."""
        median, p95 = np.percentile(self.times, [50, 95]) / 1e3
        return {"figure": figure, "resolver": self.resolver, "joints": self.joints,
                "tasks": self.tasks, "rows": ROWS * self.tasks, "solves": len(self.times),
                "median_us": float(median), "p95_us": float(p95)}


def run(seconds: float, tasks: Sequence[tuple[int, int]] = TASKS,
        joints: Sequence[tuple[int, int]] = JOINTS, seed: int = 0) -> list[dict[str, Any]]:
    """Time all resolvers with priorities over tasks and joints; print and return the rows.

    All sizes and candidates take turns on one core for `seconds` [s] in total, at least once each.
    """
    field = {"tasks": _field(tasks, seed), "joints": _field(joints, seed + 1)}
    everyone = [timed for some in field.values() for timed in some]
    with one_core():
        for timed in everyone:
            timed.call()
        end = perf_counter() + seconds
        while True:
            for timed in everyone:
                timed.take_turn()
            if perf_counter() > end:
                break
    rows = [timed.row(figure) for figure, some in field.items() for timed in some]
    console = Console(highlight=False, markup=False)
    for figure in field:
        _print(console, figure, [row for row in rows if row["figure"] == figure])
    return rows


def random_hierarchy(joints: int, tasks: int, seed: int) -> Hierarchy:
    """Return `tasks` levels of three random rows, almost surely of full rank."""
    rng = np.random.default_rng(seed)
    return Hierarchy.from_levels([(rng.normal(size=(ROWS, joints)), rng.normal(size=ROWS))
                                  for _ in range(tasks)])


def exponents(rows: Sequence[dict[str, Any]], figure: str) -> dict[str, float]:
    """Return for each resolver the slope of log time over log size, in the upper half of sizes."""
    found: dict[str, float] = {}
    for label in dict.fromkeys(row["resolver"] for row in rows):
        points = sorted((row[figure], row["median_us"]) for row in rows
                        if row["figure"] == figure and row["resolver"] == label)
        upper = np.log(points[min(len(points) // 2, max(len(points) - FITTED, 0)):])
        found[label] = (float(np.polyfit(upper[:, 0], upper[:, 1], 1)[0]) if len(upper) > 1
                        else float("nan"))
    return found


def _field(sizes: Sequence[tuple[int, int]], seed: int) -> list[Timed]:
    solves = {label: solve for label, solve in entrants().items() if label not in LEVEL_LESS}
    return [Timed(label, joints, tasks, _call(solve, random_hierarchy(joints, tasks, seed + i)))
            for i, (joints, tasks) in enumerate(sizes) for label, solve in solves.items()]


def _call(solve: Callable[[Hierarchy], Any], h: Hierarchy) -> Callable[[], Any]:
    return lambda: solve(h)


def _print(console: Console, figure: str, rows: Sequence[dict[str, Any]]) -> None:
    """Print a table with one column per size, and a summary."""
    sizes = list(dict.fromkeys(row[figure] for row in rows))
    labels = list(dict.fromkeys(row["resolver"] for row in rows))
    medians = {(row["resolver"], row[figure]): row["median_us"] for row in rows}
    powers = exponents(rows, figure)
    fixed = (f"{rows[0]['joints']} joints" if figure == "tasks" else f"{rows[0]['tasks']} tasks")
    console.print(f"Median time of a solve [us], {fixed}, {ROWS} rows a task, over the number of "
                  f"{figure}")
    table = table_of_numbers((*map(str, sizes), "power"))
    for label in labels:
        table.add_row(label, *(_digits(medians[label, size]) for size in sizes),
                      f"{powers[label]:.2f}")
    console.print(table)
    console.print(said(rows, figure), "", sep="\n")


def said(rows: Sequence[dict[str, Any]], figure: str) -> str:
    """Return in a sentence which resolver is fastest at the largest size, and by how much."""
    largest = max(row[figure] for row in rows)
    times = {row["resolver"]: row["median_us"] for row in rows if row[figure] == largest}
    first, *rest = sorted(times, key=times.__getitem__)
    others = ", ".join(f"{label} {_digits(times[label] / times[first])}" for label in rest)
    return (f"Result: at {largest} {figure} {first} is fastest, {_digits(times[first])} us; times "
            f"of the others relative to it: {others}.")


def _digits(value: float) -> str:
    """Return a number with two digits, or all digits before the decimal point."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.1f}"
