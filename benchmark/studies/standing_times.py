"""Time of a solve of the pushed humanoid: python -m benchmark.studies.standing_times.

All resolvers solve what they are asked in the states of one run of `stand-push` under `hcod`, each
tick from their memory of the one before, by turns. The run has the push and what follows it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from time import perf_counter_ns

import typer

from benchmark.machine import one_core
from benchmark.report import Report, Section
from benchmark.reproduce.studies import STUDIES
from benchmark.store import Row
from benchmark.studies.recorded import problems_at
from benchmark.tables import Column, Table, whole
from benchmark.timing import times_of
from hierarchy.problem import Hierarchy
from scenarios import load, simulate
from solvers import Resolver, Status
from solvers.qp.backends import BACKENDS, installed

_WARM_UP = 50
_REFERENCE = "weighted"


def run(ticks: int = 500, turns: int = 2) -> Report:
    """Time all resolvers on the ticks of the run, as often as there are turns."""
    scenario = load("stand-push")
    states = simulate(scenario.with_changes({
        "control.duration": ticks * scenario.control.period}))
    give = next(one for one in STUDIES["standing"].columns if one.name == "give").set
    asked = [("strict", "hcod", {}), ("give", "hcod", {
        key: value for key, value in give.items() if key.endswith("give")}),
        (_REFERENCE, "weighted", {}), ("bounds", "tpm", {"limits.place": "bounds"}),
        ("equalities", "tpm", {}), *((f"strict, {name}", f"hqp:backend={name}", {})
                                     for name in BACKENDS if installed(name))]
    everybody: dict[str, tuple[Resolver, list[Hierarchy]]] = {}
    for label, spec, changes in asked:
        other = load("stand-push", changes).with_resolver(spec)
        everybody[label] = other.make_resolver(), problems_at(states, other)
    spent: dict[str, list[tuple[int, bool]]] = {label: [] for label in everybody}
    with one_core():
        for resolver, problems in everybody.values():
            list(_solved(resolver, problems[:_WARM_UP]))
        for _ in range(turns):
            for label, (resolver, problems) in everybody.items():
                spent[label] += _solved(resolver, problems)
    rows: list[Row] = [{"entrant": label, **times_of([time for time, _ in some]), "unsolved":
             f"{sum(not solved for _, solved in some) // turns} of {ticks}"}
            for label, some in spent.items()]
    usual = next(row["median_us"] for row in rows if row["entrant"] == _REFERENCE)
    for row in rows:
        row["ratio"] = row["median_us"] / usual
    return Report("Times of the pushed humanoid", [Section("", [Table("", rows, (
        Column("median [us]", "median_us", whole), Column("p95", "p95_us", whole),
        Column("p99.9", "p99.9_us", whole), Column("not solved", "unsolved", str),
        Column(f"median / {_REFERENCE}", "ratio")))])], {"standing": rows})


def _solved(resolver: Resolver, problems: Iterable[Hierarchy]) -> Iterator[tuple[int, bool]]:
    """Yield the time [ns] of each tick, and whether it was solved."""
    memory = None
    for h in problems:
        begin = perf_counter_ns()
        res = resolver.solve(h, memory)
        yield perf_counter_ns() - begin, res.status is Status.SOLVED
        memory = res.memory


def main(ticks: int = 500, turns: int = 2) -> None:
    """Print the table."""
    run(ticks, turns).say()


if __name__ == "__main__":
    typer.run(main)
