"""What happened in a run: trouble, contacts, the largest changes of its command, and why."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from hierarchy.errors import HierarchyError, whole
from hierarchy.problem import Array, Hierarchy
from scenarios.cell.build import Cell, build, stack_resolver
from scenarios.measure.causes import Cause, Solve, Tick, causes
from scenarios.measure.judging import Rows
from scenarios.measure.safety import STEPS
from scenarios.recording.recording import Recording
from solvers import Status
from solvers.resolvers.merged import Merged

_LARGEST = 3
_UNITS = {"torque": "N m", "acceleration": "rad/s^2", "velocity": "rad/s"}


@dataclass(frozen=True)
class Jump:
    """The largest entry of the change of a command into a tick; see `causes` for its causes."""

    tick: int
    t: float
    what: str
    size: float
    unit: str
    causes: tuple[Cause, ...]

    def __str__(self) -> str:
        return f"{self.what} changed by {self.size:.3g} {self.unit}"


def jumps(recording: Recording, tick: int | None = None,
          least: Mapping[str, float] | None = None) -> list[Jump]:
    """Return the three largest changes of a run's command, or that into one tick, with causes.

    `least` has, by its unit, the change from which on they are meant. Raises HierarchyError for a
    tick that the run does not have, or the first.
    """
    if tick is not None and not 0 < whole("tick", tick) < recording.ticks:
        raise HierarchyError(f"tick {tick}: the run has ticks 0 to {recording.ticks - 1}, and a "
                             "change needs the one before")
    step = np.nan_to_num(np.abs(np.diff(recording["command"], axis=0))).max(axis=1, initial=0.0)
    above = (least or {}).get(_UNITS[recording.scenario.control.level], 0.0)
    ticks = [k + 1 for k in np.argsort(-step, kind="stable")[:_LARGEST] if step[k] > above]
    if not ticks and tick is None:
        return []
    cell = build(recording.scenario)
    rows = Rows(recording, cell)
    solves = _solves(recording, cell, rows, list(map(int, ticks)) if tick is None else [tick])
    level, found = recording.scenario.control.level, []
    for k, solve in solves.items():
        change = np.nan_to_num(np.abs(recording["command"][k] - recording["command"][k - 1]))
        i = int(change.argmax())
        joint = cell.robot.velocity_names[cell.robot.n - len(change) + i]
        found.append(Jump(k, float(recording["t"][k]), f"{level} of {joint}", float(change[i]),
                          _UNITS[level], tuple(_causes(recording, cell, rows, k, solve))))
    return found


def _solves(recording: Recording, cell: Cell, rows: Rows, ticks: Sequence[int]
            ) -> dict[int, Solve]:
    """Return what answers as in each of these ticks; what `merged` carries comes from a replay."""
    resolver = stack_resolver(recording.scenario, cell.stack, cell.activation)
    carried: dict[int, Any] = {}
    memory = None

    def answer(memory: Any, h: Hierarchy) -> Array:
        return resolver.solve(h, memory).x

    for k in range(max(ticks) + 1 if isinstance(resolver, Merged) else 0):
        carried[k] = memory
        if (h := rows.hierarchy(k)) is not None:
            memory = resolver.solve(h, memory).memory
    return {k: partial(answer, carried.get(k)) for k in ticks}


def _causes(recording: Recording, cell: Cell, rows: Rows, k: int, solve: Solve) -> Iterator[Cause]:
    """Yield what is known from the recording, and what the hierarchies of both ticks say."""
    for one in (k - 1, k):
        for event in recording.events:
            if event.tick == one:
                yield Cause("status", f"{event.kind.replace('_', ' ')} in tick {one}: "
                                      f"{event.action}")
        if (status := Status(int(recording["status"][one]))) is not Status.SOLVED:
            yield Cause("status", f"tick {one} is {status.name}")
    before, after = (_tick(recording, cell, rows, one) for one in (k - 1, k))
    if before is None or after is None:
        yield Cause("other", "its rows do not follow from the recording")
        return
    yield from causes(before, after, solve)


def _tick(recording: Recording, cell: Cell, rows: Rows, k: int) -> Tick | None:
    h = rows.hierarchy(k)
    if h is None or np.isnan(rows.meant[k]).any():
        return None
    h, n = h.copy(), h.n
    effect = np.hstack([np.eye(n), np.zeros((n, 1))])
    if (contacts := cell.contacts) is not None:
        still = contacts.torques(cell.state, np.zeros(n))
        effect = np.column_stack([*(contacts.torques(cell.state, unit) - still
                                    for unit in np.eye(n)), still])
    return Tick(h, rows.meant[k], effect)


class Happening(NamedTuple):
    """What happened first at t [s], in how many ticks, and the action taken or the reason."""

    what: str
    why: str
    ticks: int
    t: float


def happened(recording: Recording) -> Iterator[Happening]:
    """Yield problems by kind, contacts, and the largest changes of the command with their causes.

    Changes count from the step that is counted in the metrics on. Their causes need the robot's
    files; where those are missing, changes are left out.
    """
    t = recording["t"]
    for (kind, action), ticks in recording.troubles().items():
        yield Happening(kind.replace("_", " "), action, len(ticks), float(t[ticks[0]]))
    touched = np.flatnonzero(recording.get("contacts", np.empty(0)))
    if touched.size:
        yield Happening("contact", "–", int(touched.size), float(t[touched[0]]))
    try:
        found = jumps(recording, least=STEPS)
    except HierarchyError:
        return
    for one in found:
        why = "; ".join(f"{kind}: {text}" for kind, text in one.causes)
        yield Happening(str(one), why or "no single cause", 1, one.t)
