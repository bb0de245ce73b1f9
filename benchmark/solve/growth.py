"""Growth of the time of a solve with the numbers of tasks, rows and joints."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from benchmark import figures
from benchmark.report import Column, Report, Row, Section, Table, short, wide
from benchmark.solve.accuracy import entrants
from benchmark.solve.interface import Problem
from benchmark.timing import take_turns
from benchmark.worker import load

Size = tuple[int, int, int]  # joints, tasks, rows of each
FIRST_PAPER: dict[str, tuple[Size, ...]] = {
    "tasks": tuple((30, count, 3) for count in range(1, 11)),
    "joints": tuple((n, 5, 3) for n in (20, 30, 45, 70, 100, 150, 200, 300))}
LARGER: dict[str, tuple[Size, ...]] = {
    "tasks": tuple((70, count, 3) for count in (1, 2, 3, 4, 5, 7, 10, 14, 20)),
    "rows": tuple((100, 5, each) for each in (1, 2, 3, 4, 6, 9, 14, 20)),
    "joints": tuple((n, 5, 3) for n in (6, 7, 10, 15, 20, 30, 45, 70, 100, 150, 200, 300))}
LEVEL_LESS = ("augmented", "weighted")  # not timed: no priorities
_NOTES = """\
Times: one call from Python, one core, all resolvers in turns; power: slope of the upper half of \
sizes, log over log."""


def run(seconds: float = 40.0, larger: bool = False) -> Report:
    """Time all resolvers with priorities at every size for `seconds` [s] in total.

    The sizes are those of the first paper, or `larger`.
    """
    sizes = LARGER if larger else FIRST_PAPER
    rows = take_turns([one for i, figure in enumerate(sizes)
                       for one in _field(figure, sizes[figure], i)], seconds)
    panels, tables = {}, []
    for figure, ((joints, tasks, each), *_) in sizes.items():
        words = {"joints": f"{joints} joints", "tasks": f"{tasks} tasks",
                 "rows": f"{each} rows a task"}
        fixed = ", ".join(text for key, text in words.items() if key != figure)
        some = [row for row in rows if row["figure"] == figure]
        made, columns = wide(some, "entrant", figure, "median_us", short)
        powers = figures.exponents(some, figure)
        tables.append(Table(
            f"Median time of a solve [us], {fixed}, over the number of {figure}",
            [{**row, "power": powers[row["entrant"]]} for row in made],
            [*columns, Column("power", "power")]))
        panels[figure] = f"number of {figure}", figure[0], fixed
    return Report("Growth of the time of a solve", [Section(
        "Median times", tables, _NOTES, {"growth": figures.over_sizes(rows, panels)})],
        {"growth": rows})


def _field(figure: str, sizes: Sequence[Size], seed: int) -> list[tuple[Row, Callable[[], Any]]]:
    solvers = {one.label: load(one.adapter)(**one.options) for one in entrants()
               if one.label not in LEVEL_LESS}
    found: list[tuple[Row, Callable[[], Any]]] = []
    for i, (joints, tasks, each) in enumerate(sizes):
        rng = np.random.default_rng(seed + i)  # almost surely of full rank, with joints enough
        b = rng.normal(size=each * tasks)
        problem = Problem(rng.normal(size=(each * tasks, joints)), b, b, np.full(tasks, each),
                          np.zeros(joints))
        found += [({"figure": figure, "entrant": label, "joints": joints, "tasks": tasks,
                    "rows": each if figure == "rows" else each * tasks},
                   partial(solver.solve, solver.prepare(problem)))
                  for label, solver in solvers.items()]
    return found
