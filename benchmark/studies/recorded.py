"""Problems of a run in a file for C: python -m benchmark.studies.recorded stand-push FILE.

The file has the first ticks of the run and the answers of `hcod`, each from the memory of the tick
before; examples/c/replay.c solves them again.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import typer

from hierarchy.errors import refuse
from hierarchy.problem import Array, Hierarchy
from scenarios import load
from scenarios.problems.recorded import window
from solvers import make


def record_sequence(file: Path, ticks: Sequence[Hierarchy], xs: Sequence[Array] = ()) -> None:
    """Write problems of one shape, and their answers if given.

    n, m, levels, count and the sizes as int64; count times A (m, n) row after row, lower, upper and
    the reference as double; count times x. Raises HierarchyError for problems of several shapes.
    """
    h = ticks[0]
    for tick, other in enumerate(ticks):
        refuse(not np.array_equal(other.sizes, h.sizes),
               f"tick {tick} has levels of {other.sizes.tolist()} rows, tick 0 of "
               f"{h.sizes.tolist()}; a file has problems of one shape: take fewer --ticks")
    head = np.array([h.n, h.m, len(h.sizes), len(ticks), *h.sizes], dtype=np.int64)
    parts = [part for h in ticks for part in (h.A.ravel(), h.lower, h.upper, h.reference)]
    file.write_bytes(head.tobytes() + np.concatenate([*parts, *xs]).tobytes())


def main(scenario: str, file: Path, ticks: int = 500) -> None:
    """Write the first ticks of a scenario, such as stand-push, to a file."""
    problems = window(load(scenario), 0, ticks)
    resolver, memory, xs = make("hcod"), None, []
    for h in problems:
        res = resolver.solve(h, memory)
        memory = res.memory
        xs.append(res.x)
    record_sequence(file, problems, xs)
    print(f"{len(problems)} problems of {scenario}: {file}")


if __name__ == "__main__":
    typer.run(main)
