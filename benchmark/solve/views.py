"""What is shown of a set of problems: tables, figures, and three sentences of fixed form."""

from collections.abc import Mapping, Sequence
from math import isnan

import numpy as np
from rich.console import Console

from benchmark import figures, report
from benchmark.report import Column, Row, Section, Table, digits, percent, power, text, whole
from benchmark.solve.judge import RIGHT, by, cells, profile, right_within, steps_of, summaries
from hierarchy.words import listed
from solvers.problems.files import Collection

NOTES = f"""\
right: share of the problems asked that are solved, and called so: every level missed by no more \
than {RIGHT:g} |a| (1 + |x|). wrong: called solved, but missed by more. modest: right, but not \
called so. failed: neither. ended: raised, crashed, or took too long. slow: not asked, since those \
before in the family took too long. miss: largest of those \
called solved, in the rows' unit, and relative to |a| (1 + |x|). moved: how far the last level \
moved one above, relative likewise. same: the same bits twice. rough: largest step between two \
ticks, beside that of the proved answers. MB: growth of the process. Times in microseconds, of one \
call from Python; C: of the solve alone, taken in a compiled loop."""
CHOSEN = ("EQ7", "INEQ7", "HUM38", "ellipse-hqp", "humanoid-reach")
"""Families whose times are drawn."""
TIMED = ("EQ7", "INEQ7", "HUM38", "human-hqp")
"""Families whose times are printed."""
_WIDELY = 0.95            # share of the problems that an entrant of the first sentence can be asked
_RATIOS = np.geomspace(1.0, 1e4, 200)  # of times, in the performance profile
_THRESHOLDS = np.geomspace(1e-9, 1e-3, 13)
_LABEL, _FAMILY = 23, 19  # width of the entrants' column and of a family's three
_ANSWERS = (Column("asked", "asked", whole), Column("right", "right", percent),
            *(Column(key, key, whole) for key in ("wrong", "modest", "failed", "ended",
                                                 "slow")))
_QUALITY = (Column("miss", "absolute", power), Column("relative", "relative", power),
            Column("moved", "moved", power), Column("same", "same", report.yes),
            Column("rough", "rough"), Column("MB", "memory_mb", whole))
IN_SHORT = (*_ANSWERS, _QUALITY[1], Column("median\n[us]", "median_us"))
_INSIDE = (Column("Python", "median_us"), Column("C", "inside_median_us"),
           Column("warm, Python", "warm_median_us"), Column("C", "warm_inside_median_us"))


def section(title: str, rows: Sequence[Row], collections: Mapping[str, Collection],
            at: Mapping[float, Sequence[Row]]) -> tuple[Section, list[Row]]:
    """Return the section of a set and the summaries behind it, of its judged rows and problems.

    at : the rows as judged by proofs at other borders of rank.
    """
    steps = steps_of(collections)
    total, some = summaries(rows, steps), cells(rows, steps)
    families = list(dict.fromkeys(row["family"] for row in rows))
    count = len({(row["family"], row["problem"]) for row in rows})
    of = "one family" if len(families) == 1 else f"{len(families)} families"
    tables = [Table(f"{title}: {count} problems of {of}", total, _ANSWERS),
              Table(f"{title}: quality", total, _QUALITY), _times(title, some, families)]
    if not any(row["asked"] for row in total):  # nobody could be: nothing to draw, no best
        return Section(title, tables, NOTES), some
    inside = [row for row in some if not isnan(row["inside_median_us"])]
    if inside:
        tables.append(Table(f"{title}: medians of compiled entrants", [
            {**row, "entrant": f"{row['family']}, {row['entrant']}"} for row in inside], _INSIDE))
    chosen = [name for name in CHOSEN if name in families] or families[:4]
    drawn = {f"{title}: performance profiles": figures.curves(
                 _RATIOS, profile(rows, _RATIOS),
                 "median time of a problem, over that of the fastest entrant"),
             f"{title}: right over threshold": figures.curves(
                 _THRESHOLDS, right_within(rows, _THRESHOLDS), "largest miss of a right answer"),
             f"{title}: time against miss": figures.time_against_error(
                 [row for row in some if row["family"] in chosen]),
             f"{title}: share right": figures.heat(some)}
    every = {border: {row["entrant"]: row for row in summaries(rows)}
             for border, rows in sorted(at.items()) if rows}
    if every:
        tables.append(_at_borders(title, every))
        drawn[f"{title}: right over border"] = figures.curves(np.array([*every]), {
            row["entrant"]: np.array([one[row["entrant"]]["right"] for one in every.values()])
            for row in total if all(row["entrant"] in one for one in every.values())},
            "angle [rad] or length from which rows are independent, sides apart")
    return Section(title, tables, NOTES, drawn, lead(title, total, some)), some


def _at_borders(title: str, every: Mapping[float, Mapping[str, Row]]) -> Table:
    """Return the numbers of wrong answers at each border of rank, from summaries by entrant."""
    found = [{**row, "border": f"{border:.0e}"} for border, some in every.items()
             for row in some.values()]
    return Table(f"{title}: answers called solved that are wrong, over the border of rank",
                 *report.wide(found, "entrant", "border", {"": "wrong"}, whole))


def entrants(versions: Mapping[str, str], limits: Mapping[str, str]) -> Section:
    """Return the section of versions and known limits."""
    rows = [{"entrant": label, "version": version, "limits": limits.get(label, "")}
            for label, version in versions.items()]
    return Section("Entrants, and what is known of their limits", [Table("", rows, (
        Column("version", "version", text), Column("limits", "limits", text)))])


def _times(title: str, cells: Sequence[Row], families: Sequence[str]) -> Table:
    """Return the table of times in a few families, as many as fit a terminal."""
    room = max(1, (Console().width - _LABEL) // _FAMILY)
    chosen = [name for name in TIMED if name in families][:room] or [*families[:room]]
    some = [row if row["answered"] else {key: row[key] for key in ("entrant", "family")}
            for row in cells if row["family"] in chosen]
    return Table(f"{title}: times; {len(chosen)} of {len(families)} families, all in summary.csv",
                 *report.wide(some, "entrant", "family", {
                     "median": "median_us", "p95": "p95_us", "warm": "warm_median_us"}))


def lead(title: str, total: Sequence[Row], cells: Sequence[Row]) -> list[str]:
    """Return who solves the most, where another is right more often, and where one is faster."""
    asked = max(row["asked"] for row in total)
    widely = {row["entrant"]: row["right"] for row in total if row["asked"] >= _WIDELY * asked}
    best = [label for label, share in widely.items() if share == max(widely.values())]
    better, faster = [], []
    for family, some in by(cells, "family"):
        own = next((row for row in some if row["entrant"] == best[0]), None)
        if own is None or not own["asked"]:  # it refuses the family, or others were added later
            continue
        other = max((row for row in some if row["entrant"] in widely and row["asked"]),
                    key=lambda row: row["right"])
        if other["right"] > own["right"]:
            better.append(f"{family} ({other['entrant']}, {percent(other['right'])} against "
                          f"{percent(own['right'])})")
        other = min((row for row in some if row["asked"] == own["asked"]
                     and row["right"] >= own["right"]), key=lambda row: row["median_us"])
        if other["median_us"] < own["median_us"]:
            faster.append(f"{family} ({other['entrant']}, {digits(other['median_us'])} µs against "
                          f"{digits(own['median_us'])} µs)")
    return [f"{title}: solved most often, of those that can be asked at least "
            f"{100 * _WIDELY:.0f} % of the problems: {listed(best)}, {percent(widely[best[0]])}.",
            f"More often right than {best[0]}: {listed(better or ['none'])}.",
            f"As often right as {best[0]}, and faster: {listed(faster or ['none'])}."]
