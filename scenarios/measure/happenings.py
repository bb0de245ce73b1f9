"""What happened in a run, and why: trouble, contacts, large changes of command, missed levels."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hierarchy.errors import HierarchyError, refuse, whole
from hierarchy.problem import Array, Hierarchy
from scenarios.cell.build import Cell, build
from scenarios.measure.causes import Cause, Solve, Tick, causes
from scenarios.measure.judging import Rows
from scenarios.measure.metric import shown
from scenarios.measure.safety import counted_from
from scenarios.recording.fate import Fate
from scenarios.recording.recording import Recording
from solvers import Status
from solvers.explain import held_back_by, most_missed
from solvers.resolvers.hcod import Hcod
from solvers.resolvers.merged import Merged

_LARGEST = 3       # jumps
_LOOKED_AT = 20   # ticks of a level, spread over those in which it was missed
_LEAST = 0.01     # share of a level's ticks: what is given up for less is not said
_OFTEN = 0.25     # share of the ticks looked at: what holds back less often is not said

Shares = tuple[tuple[str, float], ...]


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
        return f"{self.what} changed by {shown(self.size, self.unit)}"


def jumps(recording: Recording, tick: int | None = None, least: float = 0.0) -> list[Jump]:
    """Return the three largest changes of a run's command, or that into one tick, with causes.

    Changes up to `least`, in the unit of the command, are left out. Raises HierarchyError for a
    tick that the run does not have, or the first.
    """
    refuse(tick is not None and not 0 < whole("tick", tick) < recording.ticks, f"tick {tick}: the "
           f"run has ticks 0 to {recording.ticks - 1}, and a change needs the one before")
    steps = np.nan_to_num(np.abs(np.diff(recording["command"], axis=0)))
    size = steps.max(axis=1, initial=0.0)
    ticks = [k + 1 for k in np.argsort(-size, kind="stable")[:_LARGEST] if size[k] > least]
    if not ticks and tick is None:
        return []
    cell = build(recording.scenario)
    rows = Rows(recording, cell)
    solves = _solves(recording, cell, rows, list(map(int, ticks)) if tick is None else [tick])
    level, units, found = recording.scenario.control.level, recording.units()["command"], []
    for k, solve in solves.items():
        step, i = steps[k - 1], int(steps[k - 1].argmax())
        joint = recording.facts.robot.velocity_names[i - len(step)]  # the last are actuated
        found.append(Jump(k, float(recording["t"][k]), f"{level} of {joint}", float(step[i]),
                          units[i], tuple(_causes(recording, cell, rows, k, solve))))
    return found


def _solves(recording: Recording, cell: Cell, rows: Rows, ticks: Sequence[int]
            ) -> dict[int, Solve]:
    """Return what answers as in each of these ticks; what `merged` carries comes from a replay."""
    resolver, memory = cell.resolver, None
    carried: dict[int, Any] = {}

    def answer(memory: Any, h: Hierarchy) -> Array:
        return resolver.solve(h, memory).x

    if isinstance(getattr(resolver, "inner", resolver), Merged):  # settled or not
        for k in range(max(ticks) + 1):
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
        found = jumps(recording, least=counted_from(recording.scenario.control.level))
    except HierarchyError:
        return
    for one in found:
        why = "; ".join(f"{kind}: {text}" for kind, text in one.causes)
        yield Happening(str(one), why or "no single cause", 1, one.t)


@dataclass(frozen=True)
class GivenUp:
    """A level that was missed: the share of its ticks, seconds, its rows, and what held it back.

    Rows are inequalities. They and what held the level back have shares of the ticks looked at.
    """

    level: str
    share: float
    seconds: float
    held_by: Shares
    rows: Shares = ()

    def __str__(self) -> str:
        held, at = (", ".join(f"{name} ({100.0 * share:.0f} %)" for name, share in named)
                    for named in (self.held_by, self.rows))
        return (f"row missed: {self.level} in {100.0 * self.share:.0f} % of its ticks "
                f"({self.seconds:.3g} s)" + (f", at {at}" if at else "")
                + (f"; held back by {held}" if held else ""))


def given_up(recording: Recording) -> tuple[GivenUp, ...]:
    """Return the levels that a run missed in 1 % of their ticks or more, most important first.

    What held a level back is that of the exact resolver, at up to 20 of the ticks in which the
    level was missed. It is left out where the rows of a tick do not follow from the recording: with
    an image sensor, in a smooth stack, or where settings were changed by hand.
    """
    if "level_fate" not in recording or not recording.ticks:
        return ()
    fate = recording["level_fate"]
    found = []
    for column, name in enumerate(recording.task_names):
        known, missed = fate[:, column] > Fate.UNKNOWN, fate[:, column] == Fate.MISSED
        if missed.sum() >= max(1.0, _LEAST * known.sum()):
            found.append((name, float(missed.sum() / known.sum()), np.flatnonzero(missed)))
    period = recording.scenario.control.period
    blocked = _blocked(recording, {name: ticks for name, _, ticks in found})
    return tuple(GivenUp(name, share, len(ticks) * period, *blocked.get(name, ((), ())))
                 for name, share, ticks in found)


def _blocked(recording: Recording, missed: dict[str, NDArray[np.int64]]
             ) -> dict[str, tuple[Shares, Shares]]:
    """Return what held each level back, and which of its inequalities were missed."""
    scenario = recording.scenario
    if not missed or scenario.sensor.kind != "exact" or scenario.control.stack == "smooth":
        return {}
    cell = build(scenario)
    rows, exact = Rows(recording, cell), Hcod()
    found = {}
    for name, ticks in missed.items():
        held, at, looked = Counter[str](), Counter[str](), 0
        for tick in ticks[np.unique(np.linspace(0, len(ticks) - 1, _LOOKED_AT).astype(int))]:
            h = rows.hierarchy(int(tick))
            if h is not None and name in h.names:
                names = cell.stack.row_names(h.names)
                level, solved = h.names.index(name), exact.solve(h)
                held.update(held_back_by(h, solved, level, names))
                at.update(most_missed(h, solved.x, level, names))
                looked += 1
        blocked, rows_at = (tuple(
            (what, times / looked) for what, times in count.most_common(4)
            if times >= _OFTEN * looked) for count in (held, at))
        found[name] = blocked, rows_at
    return found
