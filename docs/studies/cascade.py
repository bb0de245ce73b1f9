"""How much each backend of `hqp` solves: python docs/studies/cascade.py."""

from __future__ import annotations

from typing import Any

from rich.console import Console

from scenarios.bench.families import FAMILIES, family
from scenarios.bench.rows import table_of_numbers
from solvers import Status, make
from solvers.qp.backends import BACKENDS, installed
from solvers.resolvers.hqp import FORMS, CascadeResolution


def run(families: tuple[str, ...] = FAMILIES) -> list[dict[str, Any]]:
    """Solve every family with every backend in both forms; print and return what came of it.

    A row has the share solved, the largest error of a level's violation among those, at levels
    that are well-posed, and the share of the programs whose answer was not good enough as it was.
    """
    rows = [_row(name, backend, form) for backend in BACKENDS if installed(backend)
            for form in FORMS for name in families]
    _print(rows, families)
    return rows


def _row(name: str, backend: str, form: str) -> dict[str, Any]:
    hqp, problems = make("hqp", backend=backend, form=form), family(name)
    solved, error, programs, corrected = 0, 0.0, 0, 0
    for problem in problems:
        res = hqp.solve(problem.h)
        if isinstance(res, CascadeResolution):
            programs, corrected = programs + res.iterations, corrected + res.corrected
        if res.status is Status.SOLVED:
            off = abs(problem.h.violations(res.x) - problem.norms)
            solved, error = solved + 1, max(error, float(off.max()))
    return {"family": name, "backend": backend, "form": form, "accuracy": hqp.accuracy,
            "solved": solved / len(problems), "largest_error": error,
            "corrected": corrected / max(programs, 1)}


def _print(rows: list[dict[str, Any]], families: tuple[str, ...]) -> None:
    console = Console(highlight=False)
    for title, key, digits in (("solved [%]", "solved", "{:.0f}"),
                               ("largest error of a level's violation", "largest_error", "{:.0e}"),
                               ("answers of the backend that were corrected [%]", "corrected",
                                "{:.0f}")):
        scale = 100.0 if "%" in title else 1.0
        table = table_of_numbers(families, title)
        for backend, form in dict.fromkeys((row["backend"], row["form"]) for row in rows):
            table.add_row(f"{backend} {form}", *(
                digits.format(scale * row[key]) for row in rows
                if (row["backend"], row["form"]) == (backend, form)))
        console.print(table)
        console.print("")


if __name__ == "__main__":
    run()
