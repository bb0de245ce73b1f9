"""Time of a solve of the pushed humanoid: python docs/studies/standing_times.py.

All resolvers solve what they are asked in the states of one run of `stand-push` under `hcod`, each
tick from their memory of the one before, by turns. The run has the push and what follows it.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from time import perf_counter_ns
from typing import Any, final

import numpy as np
from recorded import problems_at
from rich.console import Console
from rich.table import Table

from hierarchy.problem import Hierarchy
from scenarios import load, simulate
from scenarios.bench.machine import one_core
from scenarios.reproduce.studies import GIVING
from solvers import Resolver, Status
from solvers.qp.backends import BACKENDS, installed

TICKS, TURNS, WARM_UP = 500, 2, 50
_REFERENCE = "weighted"


@final
@dataclass
class Entrant:
    """A resolver, its problems tick by tick, and what was measured on them.

    times [ns] of all turns; unsolved : ticks of the last turn that were not SOLVED.
    """

    label: str
    resolver: Resolver[Any]
    ticks: list[Hierarchy]
    times: list[int] = field(default_factory=list)
    unsolved: int = 0

    def warm_up(self) -> None:
        """Solve the first ticks untimed, which also compiles."""
        memory = None
        for h in self.ticks[:WARM_UP]:
            memory = self.resolver.solve(h, memory).memory

    def take_turn(self) -> None:
        """Solve all ticks in order."""
        memory, self.unsolved = None, 0
        for h in self.ticks:
            begin = perf_counter_ns()
            res = self.resolver.solve(h, memory)
            self.times.append(perf_counter_ns() - begin)
            memory = res.memory
            self.unsolved += res.status is not Status.SOLVED


def run(ticks: int = TICKS, turns: int = TURNS) -> list[Entrant]:
    """Time all; return them."""
    scenario = load("stand-push")
    states = simulate(scenario.with_changes({
        "control.duration": ticks * scenario.control.period}))
    asked = [("strict", "hcod", {}), ("give", "hcod", GIVING), (_REFERENCE, "weighted", {}),
             ("bounds", "tpm", {"limits.place": "bounds"}), ("equalities", "tpm", {}),
             *((f"strict, {name}", f"hqp:backend={name}", {}) for name in BACKENDS
               if installed(name))]
    with one_core():
        everybody = []
        for label, spec, changes in asked:
            other = load("stand-push", changes).with_resolver(spec)
            everybody.append(Entrant(label, other.make_resolver(), problems_at(states, other)))
        for one in everybody:
            one.warm_up()
        for _ in range(turns):
            for one in everybody:
                one.take_turn()
    return everybody


def print_table(everybody: list[Entrant]) -> None:
    """Print a row for each."""
    console, table = Console(highlight=False, markup=False, width=80), Table(
        box=None, padding=(0, 2, 0, 0), pad_edge=False)
    usual = next(np.median(one.times) for one in everybody if one.label == _REFERENCE)
    for title in ("", "median [us]", "p95", "p99.9", "not solved", f"median / {_REFERENCE}"):
        table.add_column(title, justify="right" if title else "left")
    for one in everybody:
        median, p95, p999 = np.percentile(one.times, [50, 95, 99.9]) / 1e3
        table.add_row(one.label, f"{median:.0f}", f"{p95:.0f}", f"{p999:.0f}",
                      f"{one.unsolved} of {len(one.ticks)}", f"{1e3 * median / usual:.2f}")
    console.print(table)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description="Times of a solve of the pushed humanoid.")
    parser.add_argument("--ticks", type=int, default=TICKS, help="of the run")
    parser.add_argument("--turns", type=int, default=TURNS, help="of all resolvers")
    given = parser.parse_args()
    print_table(run(given.ticks, given.turns))


if __name__ == "__main__":
    main()
