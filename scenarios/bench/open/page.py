"""The results as one HTML page, in the style of a comparison's report."""

from __future__ import annotations

from math import isnan
from typing import Any, NamedTuple

import numpy as np
from markupsafe import Markup

from hierarchy.words import listed
from scenarios.bench.open import figures
from scenarios.bench.open.judge import RIGHT, SOLVED
from scenarios.bench.open.printing import counted, digits, power
from scenarios.bench.open.results import Half, Results
from scenarios.bench.open.summary import Summary
from scenarios.bench.open.table import OWN
from scenarios.draw.figures.drawing import svg
from scenarios.templates import render, resource

ANSWERS = ("asked", "right", "called solved, wrong", "right, not called so", "failed", "ended",
           "largest miss", "relative", "last level moves upper", "same bits", "roughness", "MB")
TIMES = ("median", "p95", "p99.9", "largest", "inside", "warm median", "warm p99.9",
         "warm inside", "iterations", "warm iterations", "warm right")


IN_C = "hcod in C"
_WIDELY = 0.95  # share of the problems that an entrant of the first sentence can be asked


class Shown(NamedTuple):
    """The content of the page for one half."""

    title: str
    counted: str
    looks: dict[str, Any]
    profiles: Markup
    time_miss: Markup
    heat: Markup
    heat_width: int  # [px]
    answers: list[tuple[str, list[str]]]
    families: list[tuple[str, str, list[tuple[str, list[str]]]]]


def page(found: Results, command: str) -> str:
    """Return the page; it needs no other file."""
    labels = dict.fromkeys(label for half in found.halves for label in half.entrants)
    return str(render(
        "bench/open/page.html", style=resource("report/style.css"), right=f"{RIGHT:g}",
        halves=[_shown(half) for half in found.halves], heads=ANSWERS, time_heads=TIMES,
        lead=lead(found.halves[0]), command=command, missing=found.missing,
        machine=found.machine,
        entrants=[(label, found.version(label), found.limits.get(label, "")) for label in labels]))


def lead(half: Half) -> list[str]:
    """Return what one half shows, in sentences: the `first_lines`, then who is fastest where."""
    return [*first_lines(half), *_fastest(half)]


def first_lines(half: Half) -> list[str]:
    """Return who is right most often, and where others are better, in sentences.

    Where another is right more often; where a solver of others is faster, from Python and inside
    compiled code.
    """
    asked = max(one.asked for one in half.whole.values())
    widely = {label: half.whole[label] for label in half.entrants
              if half.whole[label].asked >= _WIDELY * asked}
    most = max(one.right for one in widely.values())
    best = [label for label, one in widely.items() if one.right == most]
    said = [f"{half.title}: of the entrants that can be asked at least {100.0 * _WIDELY:.0f} % of "
            f"the problems, {listed(best)} solve{'s' if len(best) == 1 else ''} the most, "
            f"{100.0 * most:.1f} %."]
    better, faster = _better(half, best[0], list(widely)), _faster(half, best[0])
    if better:
        said.append(f"Another of them is right more often than {best[0]} in {listed(better)}.")
    if faster:
        said.append(f"A solver of others is right as often as {best[0]}, and faster, in "
                    f"{listed(faster)}, each called from Python.")
    if IN_C in half.whole:
        inside = _faster(half, IN_C, inside=True)
        said.append("Without the call from Python, inside compiled code, "
                    + (f"one is right as often as {IN_C}, and faster, in {listed(inside)}."
                       if inside else f"none is right as often as {IN_C} and faster."))
    return said


def _fastest(half: Half) -> list[str]:
    fastest: dict[str, list[str]] = {}
    for family in half.families:
        own = {label: half.cells[label, family] for label in half.entrants
               if (label, family) in half.cells}
        every = max(one.asked for one in own.values())
        right = {label: one.cold.median for label, one in own.items()
                 if one.right == 1.0 and one.asked == every}
        if right:
            fastest.setdefault(min(right, key=right.__getitem__), []).append(family)
    return [f"{label} is the fastest of those that solve every problem in {len(families)} of "
            f"{len(half.families)} families: {listed(families)}."
            for label, families in sorted(fastest.items(), key=lambda one: -len(one[1]))]


def _better(half: Half, best: str, labels: list[str]) -> list[str]:
    """Return the families in which another is right more often, with who it is."""
    found = []
    for family in half.families:
        own = half.cells[best, family].right
        shares = {label: half.cells[label, family].right for label in labels
                  if (label, family) in half.cells}
        other = max(shares, key=lambda label: (shares[label], label == best))
        if shares[other] > own:
            found.append(f"{family} ({other}: {100.0 * shares[other]:.0f} % against "
                         f"{100.0 * own:.0f} %)")
    return found


def _faster(half: Half, best: str, inside: bool = False) -> list[str]:
    """Return the families in which a solver of others is right as often, and faster, with times.

    inside : compare times taken inside compiled packages.
    """
    found = []
    others = dict.fromkeys(row.entrant for row in half.rows
                           if not row.version.startswith(OWN.name))
    for family in half.families:
        cells = {label: one for label in (best, *others)
                 if (one := half.cells.get((label, family))) is not None}
        if best not in cells or isnan(cells[best].right):
            continue
        times = {label: (one.cold_inside if inside else one.cold).median
                 for label, one in cells.items()
                 if one.asked == cells[best].asked and one.right >= cells[best].right}
        label = min(times, key=lambda label: np.nan_to_num(times[label], nan=np.inf))
        if times[label] < times[best]:
            found.append(f"{family} ({label}: {digits(times[label])} µs against "
                         f"{digits(times[best])} µs)")
    return found


def _shown(half: Half) -> Shown:
    count = sum(len(half.collections[name].problems) for name in half.families)
    heat = figures.heat(half)
    return Shown(
        half.title, f"{count} problems of {len(half.families)} families", figures.drawn_as(half),
        svg(figures.profiles(half), f"{half.title}: performance profiles"),
        svg(figures.time_against_miss(half), f"{half.title}: time against miss"),
        svg(heat, f"{half.title}: share right, families and entrants"),
        round(100.0 * heat.get_figwidth()),
        [(label, _answers(half.whole[label])) for label in half.entrants],
        [(name, half.collections[name].head.what, _times(half, name)) for name in half.families])


def _answers(one: Summary) -> list[str]:
    return [*counted(one), power(one.absolute), power(one.relative), power(one.moved),
            "yes" if one.same else "no", digits(one.rough), f"{one.memory / 1024:.0f}"]


def _times(half: Half, family: str) -> list[tuple[str, list[str]]]:
    found = []
    for label in half.entrants:
        one = half.cells.get((label, family))
        if one is not None and one.counts[SOLVED]:
            whole = [one.cold.median, one.cold.p95, one.cold.p999, one.cold.largest,
                     one.cold_inside.median, one.warm.median, one.warm.p999,
                     one.warm_inside.median]
            found.append((f"{label}", [*map(digits, whole), _whole(one.iterations),
                                       _whole(one.warm_iterations),
                                       "–" if isnan(one.warm_right)
                                       else f"{100.0 * one.warm_right:.0f}%"]))
    return found


def _whole(value: float) -> str:
    return "–" if isnan(value) else f"{value:.0f}"
