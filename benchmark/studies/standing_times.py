"""Time of a solve of the pushed humanoid: python -m benchmark.studies.standing_times.

All resolvers solve what they are asked in the states of one run of `stand-push` under `hcod`, each
tick from their memory of the one before, by turns. The run has the push and what follows it.
"""

from __future__ import annotations

import argparse
from time import perf_counter_ns

import numpy as np

from benchmark.machine import one_core
from benchmark.report import Report, Section
from benchmark.reproduce.studies import STUDIES
from benchmark.studies.recorded import problems_at
from benchmark.tables import Column, Table, whole
from benchmark.timing import times_of
from hierarchy.problem import Hierarchy
from scenarios import load, simulate
from solvers import Resolver, Status
from solvers.qp.backends import BACKENDS, installed

TICKS, TURNS, WARM_UP = 500, 2, 50
_REFERENCE = "weighted"


class Entrant:
    """A resolver, its problems tick by tick, and what was measured on them."""

    def __init__(self, label: str, resolver: Resolver, ticks: list[Hierarchy]) -> None:
        self.label, self.resolver, self.ticks = label, resolver, ticks
        self.times, self.unsolved = list[int](), 0  # [ns] of all turns; ticks of the last one

    def take_turn(self, ticks: int | None = None) -> None:
        """Solve ticks in order, all of them or the first."""
        memory, self.unsolved = None, 0
        for h in self.ticks[:ticks]:
            begin = perf_counter_ns()
            res = self.resolver.solve(h, memory)
            self.times.append(perf_counter_ns() - begin)
            memory = res.memory
            self.unsolved += res.status is not Status.SOLVED


def run(ticks: int = TICKS, turns: int = TURNS) -> Report:
    """Time all."""
    scenario = load("stand-push")
    states = simulate(scenario.with_changes({
        "control.duration": ticks * scenario.control.period}))
    give = next(one for one in STUDIES["standing"].columns if one.name == "give").set
    asked = [("strict", "hcod", {}), ("give", "hcod", {
        key: value for key, value in give.items() if key.endswith("give")}),
        (_REFERENCE, "weighted", {}), ("bounds", "tpm", {"limits.place": "bounds"}),
        ("equalities", "tpm", {}), *((f"strict, {name}", f"hqp:backend={name}", {})
                                     for name in BACKENDS if installed(name))]
    with one_core():
        everybody = []
        for label, spec, changes in asked:
            other = load("stand-push", changes).with_resolver(spec)
            everybody.append(Entrant(label, other.make_resolver(), problems_at(states, other)))
        for one in everybody:
            one.take_turn(WARM_UP)
            one.times.clear()
        for _ in range(turns):
            for one in everybody:
                one.take_turn()
    usual = next(np.median(one.times) for one in everybody if one.label == _REFERENCE)
    rows = [{"entrant": one.label, **times_of(one.times), "unsolved":
             f"{one.unsolved} of {len(one.ticks)}",
             "ratio": float(np.median(one.times) / usual)} for one in everybody]
    return Report("Times of the pushed humanoid", [Section("", [Table("", rows, (
        Column("median [us]", "median_us", whole), Column("p95", "p95_us", whole),
        Column("p99.9", "p99.9_us", whole), Column("not solved", "unsolved", str),
        Column(f"median / {_REFERENCE}", "ratio")))])], {"standing": rows})


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Times of a solve of the pushed humanoid.")
    parser.add_argument("--ticks", type=int, default=TICKS, help="of the run")
    parser.add_argument("--turns", type=int, default=TURNS, help="of all resolvers")
    given = parser.parse_args()
    run(given.ticks, given.turns).say()
