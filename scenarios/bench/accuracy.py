"""Errors of tasks and of x on random 6R arms: regular, near-singular, damped, conflicting."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, final

import numpy as np
from rich.console import Console

from hierarchy.problem import Array, Hierarchy
from hierarchy.words import listed
from scenarios.bench.arms import near_singular, regular
from scenarios.bench.candidates import NUMPY, plain_numpy
from scenarios.bench.exact import damped, exact
from scenarios.bench.rows import table_of_numbers
from solvers import Resolution, Resolver, Status, certify, make, names

DAMPING, THRESHOLD = 0.05, 0.1  # the letter's code
REACHED = 1e-6                  # error up to which a task counts as reached
_FORMS = (("tpm", "published"), ("reverse", "in-order"))
_TARGETS = 1.0                  # [m/s or rad/s] the largest target of a row
_REST, _CROSSED, _FULL = ((0, 1), (2, 3), (4, 5)), ((0, 1), (1, 2), (3, 4)), (
    (0, 1), (1, 2), (3, 4), (5, 0))

Solve = Callable[[Hierarchy], Resolution]


@final
@dataclass(frozen=True)
class Case:
    """One kind of arm and of tasks.

    tasks : for each task, rows of the end effector's Jacobian: 0 to 2 position, 3 to 5 rotation. A
        row that an upper task has too conflicts with it, since the targets differ.
    jacobians : returns Jacobians (N, 6, 6) for a count N and a seed.
    """

    name: str
    title: str
    tasks: tuple[tuple[int, ...], ...]
    jacobians: Callable[[int, int], Array]
    damping: float = 0.0


CASES = (
    Case("regular", "Regular arms, three tasks of two rows", _REST, regular),
    Case("near-singular", "Near a singularity, undamped", _REST, near_singular),
    Case("damped", f"Near a singularity, damped by {DAMPING:g} below {THRESHOLD:g}", _REST,
         near_singular, DAMPING),
    Case("conflict", "Task 2 conflicts with a row of task 1", _CROSSED, regular),
    Case("crowded", "The same with a fourth task: eight rows, no redundancy left", _FULL, regular),
)


def run(count: int, checked: int, seed: int = 0,
        cases: Iterable[Case] = CASES) -> list[dict[str, Any]]:
    """Resolve `count` arms of every case with all resolvers; print tables, return the rows.

    `checked` of the arms are also compared with the exact x, and certified.
    """
    console = Console(highlight=False, markup=False)
    rows: list[dict[str, Any]] = []
    for case in cases:
        problems, least = hierarchies(case, count, seed)
        answers = [_reference(case, h) for h in problems[:checked]]
        found = [{"case": case.name, "resolver": label, "arms": count, "checked": checked,
                  **_judged(solve, case, problems, least, answers)}
                 for label, solve in entrants(case.damping).items()]
        _print(console, case, found)
        console.print(said(case, found), "", sep="\n")
        rows += found
    return rows


def entrants(damping: float = 0.0) -> dict[str, Solve]:
    """Return the solve function of each resolver by label, and plain numpy without damping."""
    solves: dict[str, Solve] = {} if damping else {NUMPY: plain_numpy}
    return {**solves, **{resolver.label: resolver.solve for resolver in resolvers(damping)}}


def resolvers(damping: float = 0.0) -> list[Resolver]:
    """Return every resolver, in each form that differs for equalities."""
    settings: dict[str, Any] = {"damping": damping, "threshold": THRESHOLD}
    usual = [make(name, **settings) for name in names()]
    return usual + [make(name, form=form, **settings) for name, form in _FORMS if name in names()]


def hierarchies(case: Case, count: int, seed: int) -> tuple[list[Hierarchy], Array]:
    """Return the problems of a case, and the smallest possible violation (count, L) of each task.

    Rows of upper tasks are always met, and all other rows can be met, so a repeated row is missed
    by the difference of its targets.
    """
    order = [row for task in case.tasks for row in task]
    sizes = np.array([len(task) for task in case.tasks])
    A = np.ascontiguousarray(case.jacobians(count, seed)[:, order])
    b = np.random.default_rng(seed + 1).uniform(-_TARGETS, _TARGETS, (count, len(order)))
    off = b - b[:, [order.index(row) for row in order]]
    least = np.sqrt(np.add.reduceat(off**2, np.cumsum(sizes) - sizes, axis=1))
    level_names = tuple(f"task {k + 1}" for k in range(len(sizes)))
    return [Hierarchy(A[i], b[i], b[i], sizes, names=level_names) for i in range(count)], least


def said(case: Case, rows: Sequence[dict[str, Any]]) -> str:
    """Return in a sentence which resolvers reach which tasks, or with damping the same x."""
    rows = [row for row in rows if not np.isnan(row["x_max"])]
    if not rows:
        return "Result: no answers."
    if case.damping:
        return f"Result: {_damped_parties(rows)}."
    tasks = [f"task_{k + 1}_max" for k in range(len(case.tasks))]
    worst = {row["resolver"]: max(row[key] for key in tasks) for row in rows}
    reached = {label: off for label, off in worst.items() if off <= REACHED}
    parts = [f"the smallest possible errors are reached by {listed(list(reached))}, "
             f"{_between(reached)}"] if reached else []
    parts += [_missing(row, tasks) for row in rows if row["resolver"] not in reached]
    return f"Result: {'; '.join(parts)}."


def _missing(row: Mapping[str, Any], tasks: Sequence[str]) -> str:
    errors = {f"task {k + 1}": row[key] for k, key in enumerate(tasks)}
    rest = [off for off in errors.values() if off <= REACHED]
    off = listed([f"{task} by up to {off:.1g}" for task, off in errors.items() if off > REACHED])
    return f"{row['resolver']} misses {off}{f', the rest by {max(rest):.0e}' if rest else ''}"


def _damped_parties(rows: Sequence[dict[str, Any]]) -> str:
    same = {row["resolver"]: row["x_max"] for row in rows if row["x_max"] <= REACHED}
    other = {row["resolver"]: row["x_max"] for row in rows if row["resolver"] not in same}
    parts = [f"the damped reference x is found by {listed(list(same))}, {_between(same)}"
             ] if same else []
    parts += [f"another x by {listed(list(other))}, up to {max(other.values()):.1g} away"
              ] if other else []
    return "; ".join(parts)


def _between(errors: Mapping[str, float]) -> str:
    best, worst = min(errors, key=errors.__getitem__), max(errors, key=errors.__getitem__)
    if best == worst:
        return f"to {errors[best]:.0e}"
    return f"to between {errors[best]:.0e} ({best}) and {errors[worst]:.0e} ({worst})"


def _reference(case: Case, h: Hierarchy) -> Array:
    return damped(h, case.damping, THRESHOLD) if case.damping else exact(h)


def _judged(solve: Solve, case: Case, problems: Sequence[Hierarchy], least: Array,
            answers: Sequence[Array]) -> dict[str, Any]:
    """Solve every problem; return errors of tasks and x, and the shares certified and failed."""
    answered = [solve(h) for h in problems]
    solved = np.array([res.status is Status.SOLVED for res in answered])
    errors = np.array([abs(h.violations(res.x) - lowest) for h, res, lowest in zip(
        problems, answered, least, strict=True)])[solved]
    sample = [(h, res.x, x) for h, res, x in zip(problems, answered, answers, strict=False)
              if res.status is Status.SOLVED]
    x_errors = [float(np.linalg.norm(x - right) / (1.0 + np.linalg.norm(right)))
                for _, x, right in sample]
    certified = [certify(h, x).certified for h, x, _ in sample]
    tasks = {f"task_{k + 1}_{key}": value for k in range(len(case.tasks))
             for key, value in _summary(errors[:, k]).items()}
    return {"failed": int((~solved).sum()), **tasks,
            **{f"x_{key}": value for key, value in _summary(x_errors).items()},
            "certified": None if case.damping else sum(certified) / max(len(answers), 1)}


def _summary(errors: Sequence[float] | Array) -> dict[str, float]:
    if not len(errors):  # no answers
        return dict.fromkeys(("mean", "median", "max"), float("nan"))
    return {"mean": float(np.mean(errors)), "median": float(np.median(errors)),
            "max": float(np.max(errors))}


def _print(console: Console, case: Case, rows: Sequence[dict[str, Any]]) -> None:
    console.print(f"{case.title}; {rows[0]['arms']} arms")
    keys = [(f"task_{k + 1}_{key}", f"{over}\n{key}") for k in range(len(case.tasks))
            for key, over in (("mean", f"task {k + 1}"), ("max", ""))] + [("x_max", "x\nmax")]
    table = table_of_numbers([*(head for _, head in keys), "cert"])
    for row in rows:
        cells = ["–" if np.isnan(row[key]) else f"{row[key]:.0e}" for key, _ in keys]
        certified = "–" if row["certified"] is None else f"{100.0 * row['certified']:.0f}%"
        table.add_row(row["resolver"], *cells, certified)
    console.print(table)
    failed = {row["resolver"]: row["failed"] for row in rows if row["failed"]}
    if failed:
        console.print("no answer: " + ", ".join(
            f"{label} {number}" for label, number in failed.items()))
