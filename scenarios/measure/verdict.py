"""What runs came to, also side by side: who reached the end, which promise broke, how far off."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from hierarchy.notebook import html_table
from hierarchy.words import gathered, some
from scenarios.measure.goals import Goal, goals, percent
from scenarios.measure.metric import shown
from scenarios.measure.motions import partings
from scenarios.measure.runs import Run, table
from scenarios.recording.recording import Recording

_NAMED = 3  # things that a sentence names


@dataclass(frozen=True)
class Verdict:
    """What one run came to.

    seconds : how long it ran, of those `planned`. fault : why it ended early, or None. stands :
    whether its robot is one that can fall. helped : ticks in which its policy stepped in.
    """

    label: str
    seconds: float
    planned: float
    fault: str | None
    stands: bool
    goals: tuple[Goal, ...]
    helped: int = 0

    @property
    def end(self) -> str:
        """How it ended: ran the whole time, stood, fell, or stopped; or how far it is."""
        if self.fault is None:
            did = "stood" if self.stands else "ran"
            return f"{did} the whole {self.planned:.4g} s" if self.seconds >= self.planned else (
                f"{did} for {self.seconds:.2f} of {self.planned:.4g} s")
        how = "fell" if "fallen" in self.fault else "stopped"
        return f"{how} at {self.seconds:.2f} s of {self.planned:.4g} s: {self.fault}"

    def on_page(self) -> dict[str, list[Any]]:
        """Return how it ended, a line for each goal, and the indices of those about unmet ones."""
        missed = [k for k, goal in enumerate(self.goals, 1) if not goal.met]
        return {"goals": [_sentence(self.end).removesuffix("."), *map(str, self.goals)],
                "missed": missed}

    def as_plain_data(self) -> dict[str, Any]:
        """Return the verdict for a JSON file."""
        return {"end": self.end, "goals": [
            {**dataclasses.asdict(goal), "flag": goal.flag} for goal in self.goals]}


def verdict(recording: Recording, label: str = "") -> Verdict:
    """Return what a run came to."""
    scenario, base = recording.scenario, recording.facts.robot.base
    return Verdict(label, recording.seconds, scenario.control.lasts, recording.fault,
                   base == "floating" and bool(scenario.contacts), goals(recording),
                   len({event.tick for event in recording.events}))


def verdicts(runs: Sequence[Run]) -> tuple[Verdict, ...]:
    """Return the verdict of each run; one that could not begin has no goals."""
    return tuple(
        verdict(run.recording, run.label) if run.recording is not None else
        Verdict(run.label, 0.0, run.scenario.control.lasts, run.error, False, ())
        for run in runs)


def lines(found: Sequence[Verdict]) -> tuple[str, ...]:
    """Return three sentences about one run or several: ends, promises, targets.

    A run is called by the first word of its label, where that is enough.
    """
    words = [one.label.partition(" ")[0] for one in found]
    if len(set(words)) == len(words):
        found = [dataclasses.replace(one, label=word)
                 for one, word in zip(found, words, strict=True)]
    return tuple(line for line in (_ends(found), _promises(found), _targets(found)) if line)


def goal_table(found: Sequence[Verdict]) -> list[tuple[str, tuple[str, ...]]]:
    """Return a row for each goal: what was asked, and each run's cell."""
    by = [{goal.title: goal for goal in one.goals} for one in found]
    titles = dict.fromkeys(title for one in by for title in one)
    return [(title, tuple(one[title].cell if title in one else "–" for one in by))
            for title in titles]


def _ends(found: Sequence[Verdict]) -> str:
    """Return who reached the end, and where and why the others did not."""
    if len(found) == 1:
        said = found[0].end
    else:
        whole = [one for one in found if one.fault is None]
        did = "stood" if all(one.stands for one in found) else "ran"
        said = f"{len(whole)} of {len(found)} {did} to the end"
        said += "".join(f"; {one.label} {one.end}" for one in found if one.fault is not None)
    helped = [f"{one.label} {one.helped}".strip() for one in found if one.helped]
    return _sentence(said + (f"; ticks in which the policy stepped in: {', '.join(helped)}"
                             if helped else ""))


def _promises(found: Sequence[Verdict]) -> str:
    """Return which promises broke, under whom, and by how much at worst."""
    by = gathered(((f"{goal.name} {goal.asked}".strip(), goal.unit), (one.label, goal))
                  for one in found for goal in one.goals if goal.promise and not goal.met)
    if not by:
        promised = any(goal.promise for one in found for goal in one.goals)
        return "Every promise was kept." if promised else ""
    said = []
    for (what, _), who in by.items():
        worst = max((goal for _, goal in who), key=lambda goal: goal.worst)
        under = "" if len(found) == 1 else " under all" if len(who) == len(found) else (
            f" under {some([label for label, _ in who], _NAMED)}")
        said.append(f"{what}{under}, by up to {shown(worst.worst, worst.unit)}, for "
                    f"{percent(worst.share)} of the time")
    return _sentence(f"broken: {'; '.join(said)}")


def _targets(found: Sequence[Verdict]) -> str:
    """Return how far from its targets the best and the worst run are in the median.

    Those that were left come first, in order of priority.
    """
    by: dict[tuple[str, str], dict[str, Goal]] = {}
    for one in found:
        for goal in one.goals:
            if not goal.promise:
                by.setdefault((goal.name, goal.unit), {})[one.label] = goal
    left = sorted(by.items(), key=lambda one: all(goal.met for goal in one[1].values()))
    said = []
    for (name, _), of in left[:_NAMED]:
        ranked = sorted(of, key=lambda label: float(f"{of[label].median:.3g}"))
        low, high = (shown(of[label].median, of[label].unit) for label in (ranked[0], ranked[-1]))
        worst = max(of.values(), key=lambda goal: goal.worst)
        said.append((f"{name} {low}" if low == high else
                     f"{name} {low} ({ranked[0]}) to {high} ({ranked[-1]})")
                    + f", {shown(worst.worst, worst.unit)} at worst")
    return _sentence(f"off in the median: {'; '.join(said)}") if said else ""


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


@dataclass(frozen=True, repr=False)
class Comparison:
    """Runs in the order asked for, scenario by scenario.

    `refused` says of each resolver that cannot resolve a scenario why it was not run; `folder` is
    where the runs' folders lie, as it was named, or None if they were not kept.
    """

    runs: tuple[Run, ...]
    command: str
    versions: dict[str, str]
    refused: tuple[str, ...] = ()
    folder: str | None = None

    def __repr__(self) -> str:
        labels = dict.fromkeys(run.label for run in self.runs)
        return (f"Comparison({', '.join(self._names)} under {', '.join(labels)}; "
                f"{len(self.runs)} runs, {len(self.faults)} faults)")

    def _repr_html_(self) -> str:
        """Return a table for each group: a row per metric, the best in bold."""
        found = ""
        for name, runs in self.groups().items():
            rows = table(runs)
            best = {(i, j + 1) for i, row in enumerate(rows)
                    for j, cell in enumerate(row.cells) if cell.kind == "best"}
            cells = [(row.heading, *(cell.text for cell in row.cells)) for row in rows]
            faults = [("fault", *(run.fault or "" for run in runs))] if any(
                run.fault for run in runs) else []
            found += html_table(name, ("", *(run.label for run in runs)), [*cells, *faults], best)
        return found

    @property
    def _names(self) -> tuple[str, ...]:
        return tuple(dict.fromkeys(run.scenario.name for run in self.runs))

    @property
    def faults(self) -> list[Run]:
        """The runs that did not reach their end."""
        return [run for run in self.runs if run.fault]

    def groups(self) -> dict[str, list[Run]]:
        """Return the runs that stand side by side, with the name of each group.

        Those are the runs of one scenario; or, with one resolver, the runs of all scenarios.
        """
        specs = {run.spec for run in self.runs}
        if len(specs) == 1 < len(self.runs):
            return {specs.pop(): list(self.runs)}
        return {name: [run for run in self.runs if run.scenario.name == name]
                for name in self._names}

    def as_plain_data(self) -> dict[str, Any]:
        """Return what `comparison.json` holds."""
        return {"command": self.command, "versions": self.versions,
                "verdicts": {name: list(lines(verdicts(runs)))
                             for name, runs in self.groups().items()},
                "runs": [run.as_plain_data() | verdicts([run])[0].as_plain_data()
                         for run in self.runs], "refused": list(self.refused),
                "partings": {name: [
                    {"label": one.label, "from": one.other, "bound_rad": one.bound,
                     "tick": one.tick, "why": one.why,
                     "largest_rad": one.largest if math.isfinite(one.largest) else None}
                    for one in partings(runs)] for name, runs in self.groups().items()}}
