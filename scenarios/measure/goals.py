"""How far a run was from each thing that its scenario asked for, in that thing's own unit."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hierarchy.problem import Array
from scenarios.measure.metric import NOTHING, passed, shown
from scenarios.measure.safety import wanted_forces
from scenarios.recording.listed import errors
from scenarios.recording.recording import Recording

# How far off still counts as met, by unit or name. A promise is one that can be kept exactly.
TOLERANCES = {"m": 1e-3, "deg": 1.0, "rad": 1e-2, "N": 1.0, "N s": 0.1, "N m s": 0.1, "": 1e-3}
PROMISED = {"m": 1e-4, "deg": 1e-2, "rad": 1e-4, "rad/s": 1e-3, "m/s": 1e-3, "N m": 1e-3, "": 1e-6,
            "contacts in place": 5e-3}  # simulated soles creep

# What a scenario asks for: name, what, unit, how far off the run was (T,) or NaN, promised or not.
_Asked = tuple[str, str, str, Array, bool]


@dataclass(frozen=True)
class Goal:
    """How far a run was from one thing that its scenario asked for; a line says it.

    median, worst : how far off, in the SI `unit`. share : of the time, more than `tolerance` off.
    first : [s] when it first was. reached : [s] when it first was not, None if it always was.
    Before `reached` nothing counts, but that a promise broken at the start is broken further.
    """

    name: str
    asked: str
    unit: str
    promise: bool
    tolerance: float
    median: float
    worst: float
    share: float
    first: float | None
    reached: float | None

    @property
    def met(self) -> bool:
        """Whether it was never left, once reached."""
        return self.share == 0.0

    @property
    def flag(self) -> str:
        """Met or kept, left or broken, or never either."""
        met, left = ("kept", "broken") if self.promise else ("met", "left")
        return met if self.met else f"never {met}" if self.reached is None else left

    @property
    def title(self) -> str:
        """What was asked of what."""
        return f"{self.name}, {self.asked}" if self.asked else self.name

    @property
    def cell(self) -> str:
        """Median and worst, and the share of time outside, for a table."""
        if self.promise and self.met:
            return self.flag
        numbers = f"{shown(self.median, self.unit)} off, worst {shown(self.worst, self.unit)}"
        return numbers if self.met else f"{numbers}, out {percent(self.share)}"

    def __str__(self) -> str:
        since = f" from {self.reached:.2f} s on" if self.met and self.reached else ""
        said = f"{self.title}: {self.flag}{since}"
        if self.promise and self.met:
            return said
        said += (f"; {shown(self.median, self.unit)} off in the median, "
                 f"{shown(self.worst, self.unit)} at worst")
        return said if self.met else (
            f"{said}; more than {shown(self.tolerance, self.unit)} off for "
            f"{percent(self.share)} of the time, first at {self.first:.2f} s")


def goals(recording: Recording) -> tuple[Goal, ...]:
    """Return the goals of a run: its tasks in order of priority, then what must not be passed."""
    if not recording.ticks:
        return ()
    found = (*_tasks(recording), *_distances(recording), *_limits(recording))
    return tuple(_goal(*one, recording["t"]) for one in found if np.isfinite(one[3]).any())


def _tasks(recording: Recording) -> Iterator[_Asked]:
    scenario = recording.scenario
    if scenario.position is not None and "position_error" in recording:
        yield "position", _in_words(scenario.position), "m", recording.off_path(), False
    if scenario.pointing is not None and "pointing_error" in recording:
        for unit, off in scenario.pointing.sizes(recording.true("pointing_error")[:, None]):
            yield ("pointing", _in_words(scenario.pointing), unit, off,
                   scenario.pointing.one_sided)
    for section, unit, off in errors(recording):
        turned = unit == "deg" and hasattr(section, "rotation")
        yield (f"{section.title} turned" if turned else section.title,
               "as asked" if turned else _in_words(section), unit, off, section.one_sided)
    for task, force in wanted_forces(recording):
        yield task.title, f"{task.target[0]:g} N", "N", np.abs(force - task.target[0]), False


def _in_words(section: Any) -> str:
    """Return what a task asks for, in words."""
    if (angle := getattr(section, "alpha_d", None)) is not None:
        return f"{'in' if section.one_sided else 'on'} a cone of {angle:g}°"
    if (lowest := getattr(section, "least", None)) is not None:
        return f"{lowest:g}" + (" or more" if section.one_sided else "")
    if (apart := getattr(section, "distance", None)) is not None:
        return f"{shown(apart, 'm')} or more"
    if section.one_sided:
        return "in its bounds"
    return "at its target" if getattr(section, "path", None) is None else "on its path"


def _distances(recording: Recording) -> Iterator[_Asked]:
    avoidance = recording.scenario.avoidance
    for who, signal, name in (("body", "minimal_distance", "body"),
                              ("ee", "ee_distance", "end effector")):
        if avoidance is not None and signal in recording and who in avoidance.promised:
            kept = avoidance.promised[who]
            yield (name, f"{shown(kept, 'm')} or more from obstacles", "m",
                   np.maximum(kept - recording.true(signal), 0.0), True)
    if "contact_depth" in recording:
        yield "no contact with obstacles", "", "m", recording["contact_depth"], True
    sticks = [not contact.slides for contact in recording.scenario.contacts]
    if "slip" in recording and any(sticks):
        slip = np.fmax.reduce(recording["slip"][:, sticks], axis=1)
        yield "contacts in place", "", "m", slip, True


def _limits(recording: Recording) -> Iterator[_Asked]:
    robot, q = recording.facts.robot, recording.true("q")
    speeds = [f"{unit}/s" for unit in robot.velocity_units]
    beyond = np.maximum(recording["joint_lower"] - q, q - recording["joint_upper"])
    yield from _of_units("joint limits", robot.position_units, beyond)
    beyond = np.abs(recording.true("v")) - recording["velocity_limit"]
    yield from _of_units("speed limits", speeds, beyond)
    if "torque_limit" in recording:
        beyond = np.abs(recording["command"]) - recording["torque_limit"]
        yield from _of_units("torque limits", robot.effort_units[robot.actuated:], beyond)


def _of_units(name: str, units: Sequence[str], beyond: Array) -> Iterator[_Asked]:
    """Yield limits of joints, those in rad apart from those in m; joints without are left out."""
    has_limits = np.isfinite(beyond).any(axis=0)
    known = dict.fromkeys(np.array(units)[has_limits].tolist())
    for unit in known:
        chosen = has_limits & np.array([one == unit for one in units])
        # each joint by itself: another's return forgives nothing
        off = passed(np.maximum(beyond[:, chosen], 0.0), PROMISED.get(unit, 0.0))
        yield name, f"in {unit}" if len(known) > 1 else "", unit, off.max(axis=1), True


def _goal(name: str, asked: str, unit: str, off: Array, promise: bool, t: Array) -> Goal:
    tolerances = PROMISED if promise else TOLERANCES
    tolerance = tolerances.get(name, tolerances.get(unit, 1e-3))
    known = np.isfinite(off)
    t, off = t[known], np.where(off[known] < NOTHING, 0.0, off[known])
    within = np.flatnonzero(off <= tolerance)
    reached = float(t[within[0]]) if within.size else None
    if promise:
        off = passed(off, tolerance)
    elif within.size:
        t, off = t[within[0]:], off[within[0]:]
    outside = np.flatnonzero(off > tolerance)
    return Goal(name, asked, unit, promise, tolerance, float(np.median(off)), float(off.max()),
                outside.size / off.size, float(t[outside[0]]) if outside.size else None, reached)


def percent(share: float) -> str:
    """Return a share as it stands in a sentence; only a whole one is 100 %."""
    if share == 1.0:
        return "100 %"
    return f"{100.0 * share:.2g} %" if share < 0.995 else f"{min(100.0 * share, 99.9):.1f} %"
