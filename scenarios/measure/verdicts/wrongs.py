"""What went wrong in runs: faults, contacts, limits, distances, levels given up, no answer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from hierarchy.words import in_words, listed
from scenarios.measure.verdicts.wording import Clause, digits, measured, mm, value, who

if TYPE_CHECKING:
    from scenarios.measure.runs import Run

BEYOND = 1e-3      # [rad] beyond a joint limit that counts
CLOSER = 1e-3      # [m] below a promised distance that counts
THROUGHOUT = 0.99  # share of its ticks in which a level is missed throughout


def wrongs(runs: Sequence[Run], finished: Sequence[Run]) -> Iterator[Clause]:
    """Yield faults and violations, the gravest first; then that the runs ended, if they did."""
    found = [*_faults(runs), *_contacts(finished), *_excess(finished), *_too_near(finished),
             *_given_up(finished), *_troubles(finished)]
    yield from found or [("", f"nothing went wrong: {_completion(finished)}")]


def _faults(runs: Sequence[Run]) -> Iterator[Clause]:
    why: dict[str, list[str]] = {}
    for run in runs:
        if run.fault:
            why.setdefault(run.fault, []).append(run.label)
    for fault, labels in why.items():
        yield listed(labels), f"did not reach the end: {fault}"


def _completion(runs: Sequence[Run]) -> str:
    durations = {f"{run.scenario.control.duration:.4g} s" for run in runs}
    seconds = durations.pop() if len(durations) == 1 else "duration"
    every = {1: runs[0].label, 2: "both"}.get(len(runs), f"all {in_words(len(runs))}")
    return f"{every} ran the whole {seconds}"


def _contacts(runs: Sequence[Run]) -> Iterator[Clause]:
    touched = [run for run in runs if min(value(run, "body_distance_min", 1.0),
                                          value(run, "ee_distance_min", 1.0)) <= 0.0]
    if touched:
        yield who(touched, runs), "touched an obstacle"
    ticks = {label: count for label, count in measured(runs, "contact_ticks").items() if count}
    hit = [run for run in runs if run.label in ticks]
    if hit:
        yield who(hit, runs), f"touched something, for {_ticks(int(max(ticks.values())))} at most"


def _excess(runs: Sequence[Run]) -> Iterator[Clause]:
    beyond = [run for run in runs if value(run, "joint_limit_excess", 0.0) > BEYOND]
    if beyond:
        most = max(value(run, "joint_limit_excess", 0.0) for run in beyond)
        yield who(beyond, runs), f"passed a joint limit, by {digits(most)} rad at most"


def _too_near(runs: Sequence[Run]) -> Iterator[Clause]:
    """Yield who came nearer to an obstacle than `avoidance.distance` or `asked` says."""
    short = {run.label: short for run in runs if (short := _shortfall(run)) > CLOSER}
    near = [run for run in runs if run.label in short]
    if near:
        yield (who(near, runs), f"came up to {mm(max(short.values()))} nearer to an obstacle "
               "than asked")


def _shortfall(run: Run) -> float:
    """Return by how much a run went below the distance it should keep [m]; 0 if it did not."""
    asked = run.scenario.avoidance
    if asked is None or "ee" not in asked.promised:
        return 0.0
    return max(asked.promised["ee"] - value(run, name, np.inf)
               for name in ("body_distance_min", "ee_distance_min"))


def _given_up(runs: Sequence[Run]) -> Iterator[Clause]:
    """Yield which levels were missed whenever they acted, and which to the end of the run."""
    said: dict[str, list[Run]] = {}
    for run in runs:
        for levels, what in zip(missed(run), ("never met {}", "missed {} to the end"), strict=True):
            if levels:
                said.setdefault(what.format(listed(levels)), []).append(run)
    for what, some in said.items():
        yield who(some, runs), what


def missed(run: Run) -> tuple[list[str], list[str]]:
    """Return the tasks that a run missed throughout, and others that it missed in its last tenth.

    Ticks in which a task was not in the stack, or its fate is not known, do not count.
    """
    from scenarios.recording.fate import Fate

    if run.recording is None or "level_fate" not in run.recording:
        return [], []
    fate = run.recording["level_fate"]
    parts = fate, fate[-max(1, len(fate) // 10):]
    share, at_the_end = ((part == Fate.MISSED).sum(axis=0)
                         / np.maximum((part > Fate.UNKNOWN).sum(axis=0), 1) for part in parts)
    names = run.recording.task_names
    throughout = [name for name, one in zip(names, share, strict=True) if one >= THROUGHOUT]
    return throughout, [name for name, one in zip(names, at_the_end, strict=True)
                        if one >= THROUGHOUT and name not in throughout]


_DONE = {"stop": "was stopped", "brake": "braked", "hold": "held its last command",
         "use": "had trouble", "clamp": "was clamped to its limits"}


def _troubles(runs: Sequence[Run]) -> Iterator[Clause]:
    """Yield what was done in ticks with trouble, and who had no answer without that."""
    said: dict[str, list[Run]] = {}
    for run in runs:
        events = run.recording.events if run.recording else ()
        unsolved = value(run, "ticks_not_solved", 0.0)
        for action, done in _DONE.items():
            if ticks := {event.tick for event in events if event.action == action}:
                said.setdefault(f"{done} in {_ticks(len(ticks))}", []).append(run)
        if unsolved and not events:
            said.setdefault(f"had no answer in {_ticks(int(unsolved))}", []).append(run)
    for what, some in said.items():
        yield who(some, runs), what


def _ticks(count: int) -> str:
    return f"{count} tick{'' if count == 1 else 's'}"


def soundest(runs: Sequence[Run]) -> list[Run]:
    """Return the runs with the fewest kinds of things wrong."""
    wrong = [sum(any(True for _ in check([run])) for check in (
        _contacts, _excess, _too_near, _given_up, _troubles)) for run in runs]
    return [run for run, count in zip(runs, wrong, strict=True) if count == min(wrong)]
