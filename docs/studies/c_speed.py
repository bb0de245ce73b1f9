"""Time of a solve in C and in Python, on the same warm sequences: python docs/studies/c_speed.py.

Needs a compiler of C. The library is made, linked into c_speed.c, and takes turns with Python. A
sequence is a problem of a reference family that changes from tick to tick, or the problems of a
scenario's run. All with default settings.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter_ns
from typing import Any, final

import numpy as np
from recorded import record_sequence, recorded
from rich.console import Console

from hierarchy.problem import Hierarchy
from scenarios.bench.families import FAMILIES, family
from scenarios.bench.machine import one_core
from scenarios.bench.rows import table_of_numbers, write_rows
from solvers import Resolver, make
from solvers.library import write

SEQUENCES = (("EQ7", "tpm"), ("EQ7", "recursive"), ("EQ7", "hcod"), ("INEQ7", "hcod"),
             ("HUM38", "hcod"), ("ellipse-limits", "tpm"), ("humanoid-reach", "hcod"))
TICKS, TURNS, SOLVES = 100, 5, 20_000
_PROGRAM = Path(__file__).with_suffix(".c")


@final
@dataclass
class _Timed:
    """A sequence, and what was measured on it.

    in_c : median, p99.9 and largest time [ns] of each turn. in_python : times [ns].
    """

    name: str
    resolver: str
    ticks: list[Hierarchy]
    file: Path
    in_c: list[list[int]] = field(default_factory=list)
    in_python: list[int] = field(default_factory=list)

    def row(self) -> dict[str, Any]:
        c = np.array(self.in_c)
        median, p999 = np.percentile(self.in_python, [50, 99.9])
        return {"problems": self.name, "resolver": self.resolver, "solves": SOLVES * len(c),
                "c_median_us": float(np.median(c[:, 0])) / 1e3, "c_p99.9_us": c[:, 1].max() / 1e3,
                "c_max_us": c[:, 2].max() / 1e3, "python_median_us": median / 1e3,
                "python_p99.9_us": p999 / 1e3, "ratio": float(np.median(c[:, 0]) / median)}


def sequence(h: Hierarchy, count: int, seed: int = 0) -> list[Hierarchy]:
    """Return a hierarchy as it changes a little from tick to tick, and back to its beginning.

    Rows with one coefficient, such as bounds, keep it.
    """
    rng = np.random.default_rng(seed)
    size = np.linalg.norm(h.A, axis=1)
    directions = rng.normal(size=(2, h.m)), rng.normal(size=(2, *h.A.shape))
    directions[1][:, np.count_nonzero(h.A, axis=1) == 1] = 0.0
    ticks = []
    for phase in 2.0 * np.pi * np.arange(count) / count:
        turn = np.array([np.sin(phase), np.cos(phase)])
        shift = 0.1 * size * (turn @ directions[0])
        A = h.A * (1.0 + 0.02 * np.einsum("t,tij->ij", turn, directions[1]))
        ticks.append(h.changed(A=A, lower=h.lower + shift, upper=h.upper + shift))
    return ticks


def linked(library: Path, program: Path) -> Path:
    """Link c_speed.c with a library; return the program."""
    compiler = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if compiler is None:
        raise SystemExit("needs a compiler of C: cc, gcc or clang")
    subprocess.run([compiler, "-O2", _PROGRAM, "-I", library / "include",
                    library / "lib" / "libtask_hierarchy.a", "-lm", "-o", program], check=True)
    return program


def run(out: Path | None = None, turns: int = TURNS,
        library: Path | None = None) -> list[dict[str, Any]]:
    """Time all sequences in C and in Python by turns; print a table and return its rows.

    Writes c_speed.csv into the folder `out` if given. library : None to make it.
    """
    with tempfile.TemporaryDirectory() as name, one_core():
        folder = Path(name)
        if library is None:
            library = folder / "library"
            library.mkdir()
            write(library)
        program = linked(library, folder / "c_speed")
        everything = [_prepared(problems, resolver, folder) for problems, resolver in SEQUENCES]
        for _ in range(turns):
            for timed in everything:
                _take_turn(timed, program)
    rows = [timed.row() for timed in everything]
    _print(rows)
    if out is not None:
        write_rows(rows, out / "c_speed.csv")
    return rows


def _prepared(name: str, resolver: str, folder: Path) -> _Timed:
    ticks = (sequence(family(name)[0].h, TICKS) if name in FAMILIES else recorded(name, TICKS))
    file = folder / f"{name}-{resolver}"
    record_sequence(file, ticks)
    _in_python(make(resolver), ticks)
    return _Timed(name, resolver, ticks, file)


def _take_turn(timed: _Timed, program: Path) -> None:
    said = subprocess.run([program, timed.file, timed.resolver, str(SOLVES)], check=True,
                          capture_output=True, text=True).stdout
    _, failed, allocated, _, *times = map(int, said.split())
    if failed or allocated:
        raise AssertionError(f"{timed.name}, {timed.resolver}: {failed} failed, {allocated} "
                             "allocations")
    timed.in_c.append(times)
    resolver = make(timed.resolver)
    for _ in range(SOLVES // TICKS // 4):
        timed.in_python += _in_python(resolver, timed.ticks)


def _in_python(resolver: Resolver, ticks: list[Hierarchy]) -> list[int]:
    """Solve a sequence, each tick from the memory of the one before; return the times [ns]."""
    times, memory = [], resolver.solve(ticks[-1]).memory
    for h in ticks:
        start = perf_counter_ns()
        res = resolver.solve(h, memory)
        times.append(perf_counter_ns() - start)
        memory = res.memory
    return times


def _print(rows: list[dict[str, Any]]) -> None:
    console = Console(highlight=False, markup=False)
    table = table_of_numbers(("C median", "p99.9", "largest", "Python", "p99.9", "ratio"),
                             first="time of a solve [us]")
    for row in rows:
        table.add_row(f"{row['problems']}, {row['resolver']}", *(f"{row[key]:.2f}" for key in (
            "c_median_us", "c_p99.9_us", "c_max_us", "python_median_us", "python_p99.9_us",
            "ratio")))
    console.print(table)


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(prog="python docs/studies/c_speed.py",
                                     description="Time of a solve in C and in Python.")
    parser.add_argument("--out", type=Path, default=None,
                        help="new or empty folder; default: a new one in runs/")
    parser.add_argument("--turns", type=int, default=TURNS, help="of C and Python, alternating")
    given = parser.parse_args()
    from scenarios.files import claim, next_free

    folder = claim(given.out if given.out is not None else next_free(Path("runs") / "c-speed"))
    run(folder, given.turns)
    print(f"Numbers: {folder}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
