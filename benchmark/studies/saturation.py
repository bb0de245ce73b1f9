"""How near do resolvers come to the exact answer inside joint limits, and in what time?

    python -m benchmark.studies.saturation

Every resolver that takes bounds, on generated stacks behind a first level of bounds: mild ones,
that few joints meet, and severe ones. The exact answer is that of `hcod`, used only where `certify`
accepts it from the data alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import final

import numpy as np
import typer

from benchmark.packages import OWN, Entrant
from benchmark.report import Column, Report, Row, Section, Table, percent, power, whole
from benchmark.solve.judge import RIGHT, by, summary
from benchmark.solve.resolvers import asked
from benchmark.timing import machine
from hierarchy.problem import Hierarchy
from scenarios.problems.recorded import Problem, certified
from solvers import certify, make, names
from solvers.problems import Recipe, written

_SECONDS = 0.5  # for each resolver in each family
_HARD = Recipe(equalities_only=True, near_parallel=0.0, scales=(1.0, 1.0), spread=1.0)
NOTES = f"""\
L k: share of problems in which bounds and levels 1 to k miss no more than in the answer of hcod, \
which `certify` accepts, to {RIGHT:g} |a| (1 + |x|). near: share that is also nearest to the \
reference. miss: the largest of those called solved, relative. off: number that ended with a \
status. us: a solve from Python in microseconds, cold; warm: with the memory of the same problem \
with its targets and sides moved by up to 1 %."""
_COLUMNS = (Column("near", "nearest", percent), Column("miss", "relative", power),
            Column("off", "off", whole), Column("us", "median_us"), Column("p95", "p95_us"),
            Column("warm", "warm_median_us"))


@final
@dataclass(frozen=True)
class Family:
    """Stacks made at random.

    joints, sizes : unknowns, and rows of the levels behind the bounds.
    room : half the width of the bounds at most, as a share of the largest |x| without bounds.
    hard : levels that lose rank, are linked or conflict, as `solvers.problems` makes them.
    """

    name: str
    joints: int
    sizes: tuple[int, ...]
    room: float
    hard: bool = False

    def problem(self, seed: int) -> Hierarchy:
        """Return the stack of a seed."""
        rng = np.random.default_rng(seed)
        free = written(rng, self.joints, self.sizes, _HARD) if self.hard else (
            Hierarchy.from_levels([(rng.normal(size=(m, self.joints)), rng.normal(size=m))
                                   for m in self.sizes]))
        largest = np.abs(make("tpm").solve(free).x).max()
        half = self.room * largest * rng.uniform(0.3, 1.0, (2, self.joints))
        reference = 0.1 * self.room * largest * rng.normal(size=self.joints)
        levels = [(A, b) for A, b, _ in free.levels()]
        return Hierarchy.from_levels([(np.eye(self.joints), -half[0], half[1]), *levels], reference)

    def problems(self, count: int) -> list[Problem]:
        """Return those of the first stacks whose answer is certified."""
        found = [(h, make("hcod").solve(h).x) for h in map(self.problem, range(count))]
        return [Problem(h, certified(h, x)) for h, x in found if certify(h, x).certified]


FAMILIES = tuple(
    Family(f"{joints} joints, {'+'.join(map(str, sizes))} {what}", joints, sizes, room, hard)
    for joints, sizes, hard in ((7, (3, 1, 1), False), (7, (3, 3, 3), False), (7, (3, 3), True),
                                (30, (6, 6, 6), False))
    for what, room in (("hard, mild" if hard else "mild", 1.8),
                       ("hard, severe" if hard else "severe", 0.4)))


def main(count: int = 400, resolver: list[str] | None = None) -> None:
    """Print the tables; count : problems of a family; resolver : only this, may be repeated."""
    chosen = resolver or [name for name in names()
                          if make(name).handles in ("bounds", "inequalities")]
    entrants = [Entrant(make(name).label, OWN, "benchmark.solve.ours:Ours", {"resolver": name})
                for name in chosen]
    tables = []
    for family in FAMILIES:
        problems, levels = family.problems(count), len(family.sizes)
        raw = asked(family.name, problems, entrants, _SECONDS)
        bound = np.mean([((x <= one.h.lower[:one.h.n]) | (x >= one.h.upper[:one.h.n])).sum()
                         for one in problems if one.proof for x in [one.proof.x]])
        tables.append(Table(
            f"{family.name}: {len(problems)} problems, {bound:.1f} joints at a bound",
            [_row(own, levels) for _, own in by(raw, "entrant")],
            [*(Column(f"L {k}", f"optimal_{k}", percent) for k in range(1, levels + 1)),
             *_COLUMNS]))
    title = f"Resolvers inside limits, one core of {machine()['processor']}"
    Report(title, [Section("", tables, NOTES)]).say()


def _row(rows: Sequence[Row], levels: int) -> Row:
    """Return the summary of a resolver, and the shares by the first level that it misses."""
    found = summary(rows)
    first = np.array([levels + 2 if row["relative"] <= RIGHT else row["level"] for row in rows])
    return {**found, "off": len(rows) - found["answered"],
            "nearest": float((first > levels + 1).mean()), **{
                f"optimal_{k}": float((first > k).mean()) for k in range(1, levels + 1)}}


if __name__ == "__main__":
    typer.run(main)
