"""Time of every resolver on the reference problems, with a check of its answers.

Solvers have been tuned on the 50 stored problems of each family. Fresh problems of the same
families, with seeds not used for tuning, are timed and reported separately.
"""

from collections.abc import Sequence
from math import nan
from typing import Any

from benchmark import figures
from benchmark.packages import Entrant
from benchmark.report import TIMES, Column, Report, Row, Section, Table, percent, power, tell, whole
from benchmark.solve.entrants import ENTRANTS, HIERARCHICAL, NUMPY
from benchmark.solve.interface import Questions
from benchmark.solve.judge import RIGHT, by, judged, summary
from benchmark.timing import machine, one_core
from benchmark.worker import Repeats, load
from hierarchy.errors import check_name, refuse
from scenarios.problems import recorded
from scenarios.problems.recorded import FAMILIES
from solvers import certify, names
from solvers.qp.backends import installed

KNOWN, FRESH = "known", "fresh"
_MOST = 200      # times of one problem
_MADE = 200      # fresh problems of a family

NOTES = f"""\
Times of one call from Python, in microseconds; iter: median iterations, each resolver's own. \
cert: share certified to {RIGHT:g}, from the data alone. unso: not reported as solved. wrong: \
reported as solved, but a level is missed by more than {RIGHT:g} of its rows, or is not certified \
where no answer is stored. miss: the largest, relative. /DAQP, /numpy: ratios of medians. warm: \
with the memory of the tick before in the recorded DYN60, elsewhere of the same problem with \
targets changed by up to 1 %.
Known limitations. DAQP's hierarchical mode minimizes violations divided by the norms of the rows, \
a different problem if rows conflict and differ in norm, softened by a finite weight; it treats \
zero rows as infeasible; its arrays are prepared before timing. augmented and tpm-published are \
not strict at every rank. Resolvers for equalities skip problems with inequalities."""
_COLUMNS = (*TIMES, Column("iter", "iterations", whole), Column("cert", "certified", percent),
            Column("unso", "unsolved", whole), Column("wrong", "wrong", whole),
            Column("miss", "relative", power), Column("/DAQP", "to_daqp"),
            Column("/numpy", "to_numpy"))


def field(wanted: Sequence[str] | None = None) -> tuple[list[Entrant], dict[str, str]]:
    """Return the entrants that can be timed, and why others are missing, by label.

    wanted : names of resolvers, with all their variants and backends; None for all. The yardsticks
        are always there. Raises UnknownNameError.
    """
    for name in wanted or ():
        check_name("resolver", name, names())
    chosen = [one for one in ENTRANTS if one.label in (NUMPY, HIERARCHICAL)]
    chosen += [one for one in ENTRANTS if one.adapter.endswith("ours:Ours") and (
        wanted is None or one.label.split("-")[0].split()[0] in wanted)]
    backends = {one.label: "daqp" if one.label == HIERARCHICAL else
                one.options.get("backend", "proxqp") for one in chosen}
    missing = {label: "pip install 'task-hierarchy[qp]'" for label, backend in backends.items()
               if not installed(backend)}
    return [one for one in chosen if one.label not in missing], missing


def run(seconds: float = 0.5, families: Sequence[str] | None = None, seed: int | None = None,
        count: int | None = None, resolvers: Sequence[str] | None = None) -> Report:
    """Time resolvers by name, None for all, on every family; check every answer.

    They take turns problem by problem, so that noise of the machine affects all equally, for about
    `seconds` [s] each in each family. seed, count : of the first fresh problem of a family, None
    for stored problems only, and their number, 200 by default. Raises UnknownNameError, and
    HierarchyError for a count without a seed.
    """
    refuse(seed is None and count is not None, "--count is of fresh problems: give --fresh too")
    families = families or FAMILIES
    for name in families:
        check_name("family", name, FAMILIES)
    entrants, missing = field(resolvers)
    rows, sections = list[Row](), list[Section]()
    for origin in (KNOWN,) if seed is None else (KNOWN, FRESH):
        some = []
        for name in families:
            tell(f"{name}, {origin} ...")
            problems = (recorded.family(name) if seed is None or origin == KNOWN
                        else recorded.fresh(name, seed, count or _MADE))
            some += [{"family": name, "origin": origin, **row}
                     for row in _measured(name, problems, entrants, seconds)]
        sections.append(_section(some, origin))
        rows += some
    return Report(f"Resolvers on reference problems, one core of {machine()['processor']}",
                  [*sections, Section("", text=NOTES)],
                  {"resolvers": rows}, missing)


def _section(rows: Sequence[Row], origin: str) -> Section:
    tables = [Table(name if origin == KNOWN else f"{name}, {origin}", own, _COLUMNS)
              for name, own in by(rows, "family")]
    figure = "time-accuracy" if origin == KNOWN else f"time-accuracy-{origin}"
    return Section(origin, tables, figures={figure: figures.time_against_error(rows)})


def _measured(name: str, problems: Sequence[recorded.Problem], entrants: Sequence[Entrant],
              seconds: float) -> list[Row]:
    """Return a row for each entrant that can be asked, and one for its warm starts."""
    raw = asked(name, problems, entrants, seconds)
    warm = [_warm(row, problems[row["problem"]]) for row in raw if row.get("warm_ns")]
    rows = [_row(own, problems) for _, own in (*by(raw, "entrant"), *by(warm, "entrant"))]
    medians = {row["entrant"]: row["median_us"] for row in rows}
    return [{**row, "to_daqp": row["median_us"] / medians.get(HIERARCHICAL, nan),
             "to_numpy": row["median_us"] / medians.get(NUMPY, nan)} for row in rows]


def asked(name: str, problems: Sequence[recorded.Problem], entrants: Sequence[Entrant],
          seconds: float) -> list[Row]:
    """Ask all that can be asked, in turns on one core for `seconds` [s] each; judge the rows.

    name : of the family.
    """
    hierarchies, before = [one.h for one in problems], [one.before for one in problems]
    turn = Repeats(most=_MOST, turn=int(1e9 * seconds / len(problems)))
    running: dict[str, Questions] = {}
    with one_core():
        for one in entrants:
            own = Questions(load(one.adapter), dict(one.options), turn)
            if not own.solver.refuses(hierarchies[0]):
                own.take(hierarchies, before)
                own.asked(0)  # loads and compiles
                running[one.label] = own
        return [judged({"entrant": label, "family": name, "problem": p, **own.asked(p)}, problem.h,
                       problem.proof)
                for p, problem in enumerate(problems) for label, own in running.items()]


def _warm(row: Row, problem: recorded.Problem) -> Row:
    """Return the row of a warm start, judged as that of a cold one."""
    warm = {key: row[f"warm_{key}"] for key in ("iterations", "solved", "x")}
    return judged({**row, **warm, "entrant": f"{row['entrant']} warm", "cold_ns": row["warm_ns"]},
                  problem.h, problem.proof)


def _row(rows: Sequence[Row], problems: Sequence[recorded.Problem]) -> Row:
    certified = [row.get("solved") and certify(problems[row["problem"]].h, row["x"],
                                               RIGHT).certified for row in rows]
    found: dict[str, Any] = summary(rows)
    return {**found, "certified": sum(map(bool, certified)) / len(rows),
            "solves": sum(len(row.get("cold_ns") or ()) for row in rows),
            "unsolved": len(rows) - found["answered"]}
