"""Curves of a run, sampled at the frames that are shown."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hierarchy.problem import Array
from scenarios.recording import listed
from scenarios.recording.recording import Recording

_ERRORS = {"m": ", positions", "deg": ", directions", "rad": ", joints", "": "",
           "N s": ", linear momentum", "N m s": ", angular momentum"}
_SHOWN = {"m": (1e3, "mm"), "deg": (1.0, "°")}
_SYMBOLS = {r"$\epsilon_1$": "ε₁", r"$\epsilon_2$": "ε₂", r"$\epsilon_{ee}$": "ε_ee",
            r"$d_{min}$": "d_min"}

Areas = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Series:
    """A quantity over the frames: value and its extremes since the previous frame, (F, C) each.

    A mark is the name and the value of a reference line. `logarithmic` is the scale to draw it on.
    """

    name: str
    unit: str
    labels: tuple[str, ...]
    value: Array
    low: Array
    high: Array
    marks: Areas = ()
    logarithmic: bool = False


def marks_of(thresholds: dict[str, float]) -> Areas:
    """Return thresholds by symbol as pairs (symbol in plain text, value)."""
    return tuple((_SYMBOLS.get(name, name.strip("$")), radius)
                 for name, radius in thresholds.items())


def series(recording: Recording, ticks: NDArray[np.int64]) -> Iterator[Series]:
    """Yield the curves for which a recording has the signals, at some ticks."""
    scenario = recording.scenario
    if "position_error" in recording:
        yield _sampled("Distance from the path", "mm", ("end effector",),
                       1e3 * recording.off_path(), ticks, logarithmic=True)
    if "pointing_error" in recording and scenario.pointing is not None:
        yield _sampled("Angle to the cone's axis", "°", ("end effector",),
                       scenario.pointing.angle(recording.true("pointing_error")), ticks,
                       (("α_d", scenario.pointing.alpha_d),))
    for what, of, signal in (("Body", "body", "minimal_distance"),
                             ("End effector", "ee", "ee_distance")):
        if signal in recording and scenario.avoidance is not None:
            marks = marks_of(scenario.avoidance.thresholds[of])
            yield _sampled(f"{what} to the nearest obstacle", "m", (what.lower(),),
                           recording.true(signal), ticks, marks)
    yield from _task_errors(recording, ticks)
    yield from _forces(recording, ticks)
    yield _sampled("Joint speeds", "rad/s", recording.facts.robot.speed_names,
                   recording.true("v"), ticks)


def _task_errors(recording: Recording, ticks: NDArray[np.int64]) -> Iterator[Series]:
    """Yield the errors of listed tasks, one series per unit."""
    found: dict[str, dict[str, Array]] = {}
    for section, unit, error in listed.errors(recording):
        found.setdefault(unit, {})[section.title] = error
    for unit, errors in found.items():
        scale, shown = _SHOWN.get(unit, (1.0, unit))
        yield _sampled(f"Errors of tasks{_ERRORS.get(unit, f' in {unit}')}", shown, tuple(errors),
                       scale * np.column_stack(list(errors.values())), ticks)


def _forces(recording: Recording, ticks: NDArray[np.int64]) -> Iterator[Series]:
    """Yield the normal forces of contacts, and the largest torque as a share of its limit."""
    if "floor_force" in recording:
        contacts = recording.scenario.contacts
        yield _sampled("Normal forces", "N", tuple(one.name or one.frame for one in contacts),
                       recording["floor_force"][:, :, 2], ticks)
    if "torque_limit" in recording:
        share = 100.0 * np.abs(recording["command"]) / recording["torque_limit"]
        yield _sampled("Largest torque, of its limit", "%", ("largest torque",),
                       share.max(axis=1, initial=0.0), ticks, (("limit", 100.0),))


def _sampled(name: str, unit: str, labels: tuple[str, ...], values: Array,
             ticks: NDArray[np.int64], marks: Areas = (), logarithmic: bool = False) -> Series:
    values = values.reshape(len(values), -1)
    first = np.concatenate(([0], ticks[:-1] + 1))  # no peak between two frames is lost
    upto = values[:ticks[-1] + 1]
    return Series(name, unit, labels, values[ticks], np.fmin.reduceat(upto, first, axis=0),
                  np.fmax.reduceat(upto, first, axis=0), marks, logarithmic)
