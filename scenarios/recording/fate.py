"""The fate of each level under the command that was sent: its rows are met, inactive or missed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from scenarios.config import Scenario
from scenarios.config.sections import shared
from scenarios.config.sections.tasks import JOINT
from scenarios.recording.recording import Recording


class Fate(IntEnum):
    """Whether a task was met in one tick."""

    ABSENT = 0   # not in the stack
    UNKNOWN = 1  # in the stack; its rows are not known after the run
    FREE = 2     # one-sided rows, none of them at a side: it does not act
    MET = 3      # rows that act, and are met
    MISSED = 4   # by the norm of its violation


PHRASES = {Fate.MET: "row met", Fate.FREE: "row inactive", Fate.MISSED: "row missed",
           Fate.UNKNOWN: "in the stack, not judged", Fate.ABSENT: "not in the stack"}
_UNITS = {"position": "m", "avoidance": "m", "separation": "m", "joint limits": JOINT,
          "posture": JOINT}  # of the errors of tasks that no section lists


def row_units(scenario: Scenario, names: Sequence[str], joints: Mapping[str, str]
              ) -> tuple[str, ...]:
    """Return the unit of the rows of each task, "" where they differ or it is not known.

    `joints` are the units of the joints, by name.
    """
    sections = {task.title: task for task in scenario.tasks}
    rate = "/s" if scenario.control.level == "velocity" else "/s²"

    def unit(name: str) -> str:
        section = sections.get(name)
        if section and section.of_forces:
            return section.unit
        of_error = section.unit_among(joints) if section else _UNITS.get(name, "")
        if of_error.endswith(" s"):  # a momentum, whose rate is a force
            return of_error.removesuffix(" s")
        if of_error == JOINT:
            of_error = shared(joints.values())
        return "" if hasattr(section, "rotation") or not of_error else of_error + rate

    return tuple(unit(name) for name in names)


@dataclass(frozen=True)
class Levels:
    """Fates of N tasks and saturation of n joints in F ticks.

    names (N,) of all tasks that are in the stack in any tick of the run, units (N,) of their rows,
    "" where not known; fate (F, N) values of
    `Fate`; violation (F, N) Euclidean norm of a level's violation by the command that was sent, in
    the unit of its rows, NaN where absent or unknown; saturated (F, n) -1 or 1 where a joint is at
    the lower or upper side of its limits' box of commands, else 0.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    fate: NDArray[np.int8]
    violation: Array
    saturated: NDArray[np.int8]


def levels_at(recording: Recording, ticks: Sequence[int] | NDArray[np.int64]) -> Levels:
    """Return the recorded fates of the levels in some ticks; UNKNOWN if none were recorded."""
    ticks, names = np.asarray(ticks, dtype=np.int64), recording.task_names
    unknown = {"level_fate": np.int8(Fate.UNKNOWN) * recording.in_stack,
               "level_violation": np.full((recording.ticks, len(names)), np.nan),
               "saturated": np.zeros(recording["v"].shape, np.int8)}
    units = row_units(recording.scenario, names, recording.facts.robot.joint_units)
    return Levels(names, units, *(recording.get(name, none)[ticks]
                                  for name, none in unknown.items()))
