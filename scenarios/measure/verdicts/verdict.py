"""What a comparison comes to, in three lines made from its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING

from hierarchy.words import listed
from scenarios.measure.motions import ALIKE, departure, motions
from scenarios.measure.verdicts.caveats import caveats
from scenarios.measure.verdicts.wording import TIE, Clause, at, digits, measured, mm, who, within
from scenarios.measure.verdicts.wrongs import soundest, wrongs

if TYPE_CHECKING:
    from scenarios.measure.runs import Run


_PLAIN = ("", "all", "both")  # words of a sentence, not names


@dataclass(frozen=True)
class Verdict:
    """What went wrong, who moved alike, and what to use and why; a line may be empty."""

    wrong: str
    alike: str
    use: str

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines that say something."""
        return tuple(line for line in (self.wrong, self.alike, self.use) if line)

    def __str__(self) -> str:
        return "\n".join(self.lines)


def verdict(runs: Sequence[Run], alike: float = ALIKE, nearly: float = 1e-2) -> Verdict:
    """Return the verdict about runs side by side; only what was measured enters it.

    Runs whose joints stay within `alike` [rad] of each other's count as the same motion, and those
    within `nearly` of the first run's are said to be near it. What a run that did not reach its end
    did is not compared.
    """
    finished = [run for run in runs if run.fault is None]
    wrong = _sentence(wrongs(runs, finished))
    if not finished:
        return Verdict(wrong, "", "")
    if len({run.scenario.name for run in runs}) > 1:
        return Verdict(wrong, "", _sentence(_contrasts(finished)))
    return Verdict(wrong, _sentence(_sameness(finished, alike, nearly)),
                   _sentence(_advice(finished, alike)))


def _sentence(clauses: Iterator[Clause]) -> str:
    """Join clauses to a sentence, naming those once of whom several in a row are said."""
    said = [(who, listed([what for _, what in some]) if who else "; ".join(w for _, w in some))
            for who, some in ((who, list(some)) for who, some in groupby(clauses, itemgetter(0)))]
    text = "; ".join(f"{who} {what}".strip() for who, what in said)
    plain = said and said[0][0].partition(" ")[0] in _PLAIN  # a resolver's name stays as it is
    return f"{text[0].upper() if plain else text[0]}{text[1:]}." if text else ""


def _sameness(runs: Sequence[Run], alike: float, nearly: float) -> Iterator[Clause]:
    found = motions(runs, alike)
    if len(runs) < 2 or not found:
        return
    for motion in found:
        if len(motion.runs) > 1:
            how = f"alike to {motion.apart:.0e} rad" if motion.apart else "alike to the last bit"
            yield who(motion.runs, runs), f"moved the arm {how}"
    first = found[0].runs[0]
    apart = {one.label: departure(one.runs[0], first) for one in found[1:]}
    near = [one for one in found[1:] if apart[one.label] <= nearly]
    if near:
        yield (listed([label for one in near for label in one.labels]),
               f"stayed within {max(apart[one.label] for one in near):.0e} rad of {first.label}")
    other = [one for one in found[1:] if apart[one.label] > nearly]
    if len(found) == len(runs) and not near:
        yield "", "no two moved the arm alike"
    elif other:
        yield listed([label for one in other for label in one.labels]), "moved otherwise"


def _advice(runs: Sequence[Run], alike: float) -> Iterator[Clause]:
    """Yield who did best of those of whom the least was wrong, and who is fast among them."""
    sound = soundest(runs)
    merits = [*_tracking(sound), *_listed_tasks(sound), *_distance(sound)]
    if len(sound) < len(runs) and len(sound) == 1:
        yield "", f"use {sound[0].label}, where the least went wrong"
    elif len(motions(sound, alike)) <= 1 and len(sound) > 1:
        yield "", f"choose {who(sound, runs, 'any')} by time"
    yield from merits
    yield from _speed(sound)
    facts = {run.label: run.recording.facts.resolver for run in sound if run.recording}
    yield from (("", one) for one in caveats(facts))


def _tracking(runs: Sequence[Run]) -> Iterator[Clause]:
    found = measured(runs, "position_error_median_settled")
    best, worst = min(found.values(), default=0.0), max(found.values(), default=0.0)
    if found and worst <= (1.0 + TIE) * best:
        yield "", f"half of the time the tool was within {mm(best)} of its path"
    elif found:
        yield (who(within(found, runs, best), runs),
               f"tracked best (median path error {mm(best)}, {at(found, worst)} {mm(worst)})")


def _listed_tasks(runs: Sequence[Run]) -> Iterator[Clause]:
    """Yield in which of the scenario's own tasks the runs differ most, relative to the worst."""
    ranked = []
    for metric in runs[0].metrics.values():
        found = measured(runs, metric.name)
        if metric.name.startswith("task_") and metric.name.endswith("_rms") and found \
                and metric.lower_is_better:
            best, worst = min(found.values()), max(found.values())
            ranked.append((1.0 - best / worst if worst else 0.0, metric, found))
    ranked = sorted((one for one in ranked if one[0] > TIE), key=lambda one: -one[0])
    for _, metric, found in ranked[:1]:
        best, worst = min(found.values()), max(found.values())
        said = [f"{digits(metric.scale * value)} {metric.shown_unit}" for value in (best, worst)]
        yield (who(within(found, runs, best), runs),
               f"served {metric.label.partition(':')[0].lower()} best (rms error {said[0]}, "
               f"{at(found, worst)} {said[1]})")


def _distance(runs: Sequence[Run]) -> Iterator[Clause]:
    found = measured(runs, "body_distance_min")
    found = {label: value for label, value in found.items() if value > 0.0}
    best, worst = max(found.values(), default=0.0), min(found.values(), default=0.0)
    if found and best <= (1.0 + TIE) * worst:
        yield "", f"the body kept at least {mm(worst)} from every obstacle"
    elif found:
        yield (who(within(found, runs, best), runs), "kept the most distance from obstacles "
               f"({mm(best)}, {at(found, worst)} {mm(worst)})")


def _speed(runs: Sequence[Run]) -> Iterator[Clause]:
    found = measured(runs, "time_resolve_median")
    low, high = min(found.values(), default=0.0), max(found.values(), default=0.0)
    against = f", {at(found, high)} in {digits(1e6 * high)} µs" if high > 1.2 * low else ""
    if found:
        yield "", f"{at(found, low)} resolves a tick in {digits(1e6 * low)} µs{against}"


def _contrasts(runs: Sequence[Run]) -> Iterator[Clause]:
    """Yield where scenarios differ by half and more in what they ask of the arm."""
    for what, name, scale, unit in (("the largest joint speed step is", "velocity_step_max", 1.0,
                                     "rad/s"),
                                    ("the body came within", "body_distance_min", 1e3, "mm")):
        found = measured(runs, name)
        low, high = min(found.values(), default=0.0), max(found.values(), default=0.0)
        if high > 1.5 * low:
            yield "", (f"{what} {digits(scale * low)} {unit} in {at(found, low)}, "
                       f"{digits(scale * high)} {unit} in {at(found, high)}")
