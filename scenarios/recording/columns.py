"""A recording as columns: one per number, with its unit, one row per tick."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from scenarios.config import Scenario
from scenarios.recording.facts import Facts
from scenarios.recording.signals import known


class Recorded(Protocol):
    """The part of a `Recording` that its columns need."""

    @property
    def signals(self) -> dict[str, NDArray[Any]]: ...  # noqa: D102

    @property
    def orders(self) -> tuple[str, ...]: ...  # noqa: D102

    @property
    def scenario(self) -> Scenario: ...  # noqa: D102

    @property
    def facts(self) -> Facts: ...  # noqa: D102

    @property
    def fault(self) -> str | None: ...  # noqa: D102

    @property
    def events(self) -> tuple[Any, ...]: ...  # noqa: D102


@dataclass(frozen=True)
class Column:
    """One number or text per tick: name such as `q[0]`, unit or "", values (T,)."""

    name: str
    unit: str
    values: NDArray[Any]

    @property
    def title(self) -> str:
        """Name and unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def columns(recording: Recorded) -> Iterator[Column]:
    """Yield every per-tick signal number by number, then the stack and the events as text."""
    units = signal_units(recording)
    for name, signal in of_ticks(recording).items():
        shape = signal.shape[1:]
        unit_of = units.get(name, ("",))
        for i, place in enumerate(np.ndindex(shape)):
            index = "".join(f"[{k}]" for k in place)
            unit = unit_of[i] if len(unit_of) == int(np.prod(shape)) else unit_of[0]
            yield Column(name + index, unit, signal[(slice(None), *place)])
    yield Column("stack", "", stacks(recording))
    events = [""] * len(recording.signals["t"])
    for tick, kind, action in recording.events:
        events[tick] += f"{'; ' if events[tick] else ''}{kind}: {action}"
    yield Column("events", "", np.array(events, dtype=np.str_))


def constants(recording: Recorded) -> dict[str, NDArray[Any]]:
    """Return the signals that have one value for the whole run."""
    return {name: signal for name, signal in recording.signals.items()
            if (of := known(name)) and of.constant}


def of_ticks(recording: Recorded) -> dict[str, NDArray[Any]]:
    """Return the signals that have one entry per tick."""
    fixed = constants(recording)
    return {name: signal for name, signal in recording.signals.items() if name not in fixed}


def stacks(recording: Recorded) -> NDArray[Any]:
    """Return the tasks of each tick's stack (T,), most important first."""
    names: NDArray[Any] = np.array(recording.orders or ("",), dtype=np.str_)
    return np.asarray(names[recording.signals["order"]])


def signal_units(recording: Recorded) -> dict[str, tuple[str, ...]]:
    """Return the units of the entries of each signal with units; a single one holds for all."""
    robot, level = recording.facts.robot, recording.scenario.control.level
    velocities = tuple(f"{unit}/s" for unit in robot.velocity_units)
    accelerations = tuple(f"{unit}/s^2" for unit in robot.velocity_units)
    per_joint = {"joint": robot.position_units, "joint/s": velocities, "joint/s^2": accelerations,
                 "command": {"velocity": velocities, "acceleration": accelerations,
                             "torque": ("N m",)}[level]}
    return {name: per_joint.get(of.unit, (of.unit,)) for name in recording.signals
            if (of := known(name)) and of.unit}
