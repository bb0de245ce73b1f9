"""Time of a solve in C beside soth and LexLS in C++, on the same fresh problems, in turns.

    python docs/studies/c_peers.py --soth DIR --lexls DIR

DIR is a checkout of yours; a package without one is left out. Needs a compiler of C++, Eigen, and
Boost for soth, which takes minutes to compile. An answer is right if `certify` accepts it at 1e-6.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, final

import numpy as np
from c_speed import sequence
from recorded import record_sequence
from rich.console import Console
from rich.table import Table

from hierarchy.problem import Array, Hierarchy
from scenarios.bench.families import fresh
from scenarios.bench.machine import one_core
from scenarios.bench.open.built import BuildError, rows_from, rows_of
from scenarios.bench.open.table import Row
from solvers import certify
from solvers.library import write

SEED, COUNT, TICKS = 181_123, 50, 20  # of problems; a fifth of them begin sequences of ticks
TURNS, PASSES, RIGHT = 3, 40, 1e-6
_HERE = Path(__file__).parent
_OPTIONS = ("-std=c++17", "-O3", "-march=native", "-DNDEBUG")


@final
@dataclass(frozen=True)
class Class:
    """Problems of a family, cold or as warm sequences, who solves them, the first one ours.

    target : largest ratio of our median to that of the fastest peer whose name starts with `peer`
    and who is right.
    """

    family: str
    warm: bool
    names: tuple[str, ...]
    peer: str
    target: float

    @property
    def title(self) -> str:
        """Family, and whether warm or cold."""
        return f"{self.family} {'warm' if self.warm else 'cold'}"


CLASSES = (Class("EQ7", False, ("tpm", "hcod", "LexLSE", "LexLS", "soth"), "LexLSE", 1.0),
           Class("INEQ7", False, ("hcod", "LexLS", "LexLS bounds", "soth"), "LexLS", 1.0),
           Class("INEQ7", True, ("hcod", "LexLS", "LexLS bounds", "soth"), "LexLS", 0.8),
           Class("HUM38", False, ("hcod", "LexLS", "LexLS bounds", "soth"), "soth", 0.4),
           Class("HUM38", True, ("hcod", "LexLS", "LexLS bounds", "soth"), "soth", 1.0))


@final
@dataclass
class _Timed:
    """A solver on a class: times [ns] of all solves, and whether each x was right."""

    of: Class
    name: str
    times: list[Array] = field(default_factory=list)
    right: list[bool] = field(default_factory=list)

    def judge(self, problems: list[Hierarchy], xs: Array) -> None:
        """Certify the answers xs (problems, n)."""
        self.right += [certify(h, x, RIGHT).certified for h, x in zip(problems, xs, strict=True)]

    def row(self) -> dict[str, Any]:
        median, p95, p999 = np.percentile(np.concatenate(self.times) / 1e3, [50, 95, 99.9])
        return {"problems": self.of.title, "solver": self.name, "median": float(median),
                "p95": float(p95), "p99.9": float(p999), "right": float(np.mean(self.right))}


def problems_of(of: Class, seed: int, count: int) -> list[list[Hierarchy]]:
    """Return the problems of a class: one list if cold, a list for each sequence if warm."""
    if not of.warm:
        return [[problem.h for problem in fresh(of.family, seed, count, checked=0)]]
    starts = fresh(of.family, seed, max(1, count // 5), checked=0)
    return [sequence(problem.h, TICKS, seed + i) for i, problem in enumerate(starts)]


def compiled(folder: Path, library: Path) -> tuple[Path, dict[str, Path]]:
    """Return c_peers.cpp as a program, and our resolvers as shared libraries by name."""
    compiler = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
    if compiler is None:
        raise BuildError("no compiler of C++: c++, g++ or clang++")
    program = folder / "c_peers"
    subprocess.run([compiler, *_OPTIONS, _HERE / "c_peers.cpp", "-ldl", "-o", program], check=True)
    return program, libraries_of(rows_from(library))


def libraries_of(rows: Sequence[Row]) -> dict[str, Path]:
    """Return the shared library of each entrant, by its label."""
    return {row.label.removesuffix(" in C"): Path(row.options["library"]) for row in rows}


def run(program: Path, libraries: Mapping[str, Path], seed: int = SEED, count: int = COUNT,
        turns: int = TURNS) -> list[dict[str, Any]]:
    """Time all solvers that have a library; print tables and return their rows."""
    rows = []
    with one_core():
        for of in CLASSES:
            problems = problems_of(of, seed, count)
            solvers = [_Timed(of, name) for name in of.names if name in libraries]
            for turn in range(turns):
                for timed in solvers:
                    for some in problems:
                        xs = _take_turn(timed, program, libraries[timed.name], some)
                        if turn == 0:  # the other turns have the same answers
                            timed.judge(some, xs)
            rows += [timed.row() for timed in solvers]
    _print(rows)
    return rows


def _take_turn(timed: _Timed, program: Path, library: Path, problems: list[Hierarchy]) -> Array:
    """Solve problems, keep the times, and return the answers (problems, n)."""
    with tempfile.TemporaryDirectory() as folder:
        given, answers = Path(folder) / "problems", Path(folder) / "answers"
        record_sequence(given, problems)
        subprocess.run([program, library, given, answers, str(int(timed.of.warm)), str(PASSES)],
                       check=True, timeout=600.0)
        found = np.fromfile(answers)
    size = len(problems) * problems[0].n
    timed.times.append(found[size:])
    return found[:size].reshape(len(problems), -1)


def _print(rows: list[dict[str, Any]]) -> None:
    """Print a table for each class, its first row ours, then what became of the targets."""
    console = Console(highlight=False, markup=False)
    for of in CLASSES:
        these = [row for row in rows if row["problems"] == of.title]
        table = Table(box=None, padding=(0, 2, 0, 0), pad_edge=False)
        table.add_column(f"{of.title} [us]", no_wrap=True, min_width=18)
        for title in ("median", "p95", "p99.9", "right", "ours /it"):
            table.add_column(title, justify="right", no_wrap=True)
        for row in these:
            table.add_row(row["solver"], *(f"{row[key]:.2f}" for key in ("median", "p95", "p99.9")),
                          f"{100 * row['right']:.0f} %",
                          f"{these[0]['median'] / row['median']:.2f}")
        console.print(table)
        console.print()
    for line in verdicts(rows):
        console.print(line)


def verdicts(rows: list[dict[str, Any]]) -> list[str]:
    """Return a line for each class whose peer was timed."""
    said = []
    for of in CLASSES:
        these = [row for row in rows if row["problems"] == of.title]
        peers = [row for row in these if row["solver"].startswith(of.peer) and row["right"] > 0.9]
        if peers:
            peer = min(peers, key=lambda row: float(row["median"]))
            ratio = these[0]["median"] / peer["median"]
            said.append(f"{of.title}: {these[0]['solver']} {ratio:.2f} x {peer['solver']}, target "
                        f"{of.target:g}: {'met' if ratio <= of.target else 'not met'}")
    return said


def main() -> int:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--soth", type=Path, help="checkout of github.com/stack-of-tasks/soth")
    parser.add_argument("--lexls", type=Path, help="checkout of github.com/jrl-umi3218/lexls")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        try:
            with ThreadPoolExecutor() as pool:  # a compiler works in a process of its own
                builds = [pool.submit(rows_of, name, checkout) for name in ("lexls", "soth")
                          if (checkout := getattr(given, name))]
                write(Path(folder))
                peers = [row for build in builds for row in build.result()]
            program, libraries = compiled(Path(folder), Path(folder))
        except BuildError as error:
            print(error, file=sys.stderr)
            return 2
        run(program, {**libraries, **libraries_of(peers)})
    return 0


if __name__ == "__main__":
    sys.exit(main())
