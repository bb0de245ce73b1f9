"""What a comparison comes to, in one sentence made from its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from typing import TYPE_CHECKING

from scenarios.measure.motions import ALIKE, departure, motions
from scenarios.words import in_words, listed

if TYPE_CHECKING:
    from scenarios.measure.runs import Run

TIE = 0.05  # within which, relative to the better one, two values are not told apart in words

Clause = tuple[str, str]  # who, or "", and what is said


def verdict(runs: Sequence[Run], alike: float = ALIKE, nearly: float = 1e-2) -> str:
    """Return the sentence about runs side by side; only what was measured enters it.

    Who reached the end, who moved alike, who tracked best, who kept the most distance, who touched
    something or passed a limit, who had trouble, and who computes fastest. Runs whose joints stay
    within `alike` [rad] of each other's count as the same motion, and those within `nearly` of the
    first run's are said to be near it. What a run that did not reach its end did is not compared.
    """
    finished = [run for run in runs if run.fault is None]
    clauses: list[Clause] = [("", _completion(runs, finished))]
    if len({run.scenario.name for run in runs}) > 1:
        clauses += [*_contacts(finished), *_contrasts(finished)]
    elif finished:
        for said in (_sameness(finished, alike, nearly), _tracking(finished),
                     _listed_tasks(finished), _distance(finished),
                     _contacts(finished), _excess(finished), _troubles(finished), _speed(finished)):
            clauses += said
    return _joined(clauses)


def _joined(clauses: Sequence[Clause]) -> str:
    """Join clauses to a sentence, naming those once of whom several in a row are said."""
    said = [(who, listed([what for _, what in some]) if who else "; ".join(w for _, w in some))
            for who, some in ((who, list(some)) for who, some in groupby(clauses, itemgetter(0)))]
    return "; ".join(f"{who} {what}".strip() for who, what in said) + "."


def _completion(runs: Sequence[Run], finished: Sequence[Run]) -> str:
    durations = {f"{run.scenario.control.duration:.4g} s" for run in runs}
    seconds = durations.pop() if len(durations) == 1 else "duration"
    noun = "resolvers" if len({run.scenario.name for run in runs}) == 1 else "scenarios"
    if len(finished) == len(runs) == 1:
        return f"{runs[0].label} ran the whole {seconds}"
    if len(finished) == len(runs):
        every = "Both" if len(runs) == 2 else f"All {in_words(len(runs))}"
        return f"{every} {noun} ran the whole {seconds}"
    some = f"{in_words(len(finished)).capitalize()} of {in_words(len(runs))} {noun}"
    return (f"{some if finished else f'No {noun[:-1]}'} ran the whole {seconds} "
            f"({'; '.join(failures(runs))})")


def failures(runs: Sequence[Run]) -> list[str]:
    """Say which runs did not reach their end, those together that ended for the same reason."""
    why: dict[str, list[str]] = {}
    for run in runs:
        if run.fault:
            why.setdefault(run.fault, []).append(run.label)
    return [f"{listed(labels)} did not: {fault}" for fault, labels in why.items()]


def _sameness(runs: Sequence[Run], alike: float, nearly: float) -> Iterator[Clause]:
    found = motions(runs, alike)
    if len(runs) < 2 or not found:
        return
    for motion in found:
        if len(motion.runs) > 1:
            how = f"alike to {motion.apart:.0e} rad" if motion.apart else "alike to the last bit"
            yield _who(motion.runs, runs), f"moved the arm {how}"
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


def _tracking(runs: Sequence[Run]) -> Iterator[Clause]:
    values = _values(runs, "position_error_median_settled")
    best, worst = min(values.values(), default=0.0), max(values.values(), default=0.0)
    if values and worst <= (1.0 + TIE) * best:
        yield "", f"half of the time the tool was within {_mm(best)} of its path"
    elif values:
        yield (_who(_within(values, runs, best), runs),
               f"tracked best (median path error {_mm(best)}, {_at(values, worst)} {_mm(worst)})")


def _listed_tasks(runs: Sequence[Run]) -> Iterator[Clause]:
    """Yield in which of the scenario's own tasks the runs differ most, relative to the worst."""
    found = []
    for metric in runs[0].metrics.values():
        values = _values(runs, metric.name)
        if metric.name.startswith("task_") and metric.name.endswith("_rms") and values \
                and metric.lower_is_better:
            best, worst = min(values.values()), max(values.values())
            found.append((1.0 - best / worst if worst else 0.0, metric, values))
    found = sorted((one for one in found if one[0] > TIE), key=lambda one: -one[0])
    for _, metric, values in found[:1]:
        best, worst = min(values.values()), max(values.values())
        said = [f"{_digits(metric.scale * value)} {metric.shown_unit}" for value in (best, worst)]
        yield (_who(_within(values, runs, best), runs),
               f"served {metric.label.partition(':')[0].lower()} best (rms error {said[0]}, "
               f"{_at(values, worst)} {said[1]})")


def _distance(runs: Sequence[Run]) -> Iterator[Clause]:
    values = _values(runs, "body_distance_min")
    values = {label: value for label, value in values.items() if value > 0.0}
    best, worst = max(values.values(), default=0.0), min(values.values(), default=0.0)
    if values and best <= (1.0 + TIE) * worst:
        yield "", f"the body kept at least {_mm(worst)} from every obstacle"
    elif values:
        yield (_who(_within(values, runs, best), runs), "kept the most distance from obstacles "
               f"({_mm(best)}, {_at(values, worst)} {_mm(worst)})")


def _contacts(runs: Sequence[Run]) -> Iterator[Clause]:
    distance, ticks = _values(runs, "body_distance_min"), _values(runs, "contact_ticks")
    touched = [run for run in runs if distance.get(run.label, 1.0) <= 0.0]
    if touched:
        yield _who(touched, runs), "touched an obstacle with the body"
    touched = [run for run in runs if ticks.get(run.label, 0.0) > 0.0 and run not in touched]
    if touched:
        most = max(ticks[run.label] for run in touched)
        yield _who(touched, runs), f"touched something, for {most:.0f} ticks at most"


def _excess(runs: Sequence[Run], least: float = 1e-3) -> Iterator[Clause]:
    """Yield who passed a joint limit by more than `least` [rad]."""
    values = {label: value for label, value in _values(runs, "joint_limit_excess").items()
              if value > least}
    beyond = [run for run in runs if run.label in values]
    if beyond:
        yield (_who(beyond, runs),
               f"passed a joint limit, by {_digits(max(values.values()))} rad at most")


_DONE = {"stop": "was stopped", "brake": "braked", "hold": "held its last command",
         "use": "had trouble", "clamp": "was clamped to its limits"}


def _troubles(runs: Sequence[Run]) -> Iterator[Clause]:
    """Yield what was done in ticks with trouble, and who had no answer without that."""
    said: dict[str, list[Run]] = {}
    for run in runs:
        events = run.recording.events if run.recording else ()
        unsolved = _values([run], "ticks_not_solved").get(run.label, 0.0)
        for action, done in _DONE.items():
            if ticks := {event.tick for event in events if event.action == action}:
                said.setdefault(f"{done} in {_ticks(len(ticks))}", []).append(run)
        if unsolved and not events:
            said.setdefault(f"had no answer in {_ticks(int(unsolved))}", []).append(run)
    for what, some in said.items():
        yield _who(some, runs), what


def _ticks(count: int) -> str:
    return f"{count} tick{'' if count == 1 else 's'}"


def _contrasts(runs: Sequence[Run]) -> Iterator[Clause]:
    """Yield where scenarios differ by half and more in what they ask of the arm."""
    for what, name, scale, unit in (("the largest joint speed step is", "velocity_step_max", 1.0,
                                     "rad/s"),
                                    ("the body came within", "body_distance_min", 1e3, "mm")):
        values = _values(runs, name)
        low, high = min(values.values(), default=0.0), max(values.values(), default=0.0)
        if high > 1.5 * low:
            yield "", (f"{what} {_digits(scale * low)} {unit} in {_at(values, low)}, "
                       f"{_digits(scale * high)} {unit} in {_at(values, high)}")


def _speed(runs: Sequence[Run]) -> Iterator[Clause]:
    values = _values(runs, "time_resolve_median")
    low, high = min(values.values(), default=0.0), max(values.values(), default=0.0)
    against = f", {_at(values, high)} in {_digits(1e6 * high)} µs" if high > 1.2 * low else ""
    if values:
        yield "", f"{_at(values, low)} resolves a tick in {_digits(1e6 * low)} µs{against}"


def _values(runs: Sequence[Run], name: str) -> dict[str, float]:
    """Return a metric by label, of the runs that have it."""
    return {run.label: value for run in runs
            if name in run.metrics and (value := run.metrics[name].value) is not None}


def _within(values: dict[str, float], runs: Sequence[Run], best: float) -> list[Run]:
    """Return the runs whose value is about the best."""
    return [run for run in runs if run.label in values
            and abs(values[run.label] - best) <= TIE * max(abs(best), abs(values[run.label]))]


def _at(values: dict[str, float], value: float) -> str:
    return next(label for label, one in values.items() if one == value)


def _who(some: Sequence[Run], runs: Sequence[Run]) -> str:
    """Name some of the runs in the shortest way that is clear."""
    others = [run.label for run in runs if run not in some]
    if not others:
        return "it" if len(runs) == 1 else "both" if len(runs) == 2 else "all"
    return f"all but {listed(others)}" if len(others) < min(len(some), 3) else listed(
        [run.label for run in some])


def _mm(metres: float) -> str:
    return f"{_digits(1e3 * metres)} mm"


def _digits(value: float) -> str:
    """Return two digits, and all that stand before the point: 0.14, 1.9, 254."""
    return f"{value:.0f}" if abs(value) >= 10.0 else f"{value:.2g}"
