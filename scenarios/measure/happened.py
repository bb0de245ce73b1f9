"""What happened in a run, for lists: trouble, contacts, large changes of the command, its fault."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hierarchy.errors import HierarchyError
from scenarios.measure.jumps import jumps
from scenarios.measure.safety import STEPS

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording


class Happening(NamedTuple):
    """What happened first at t [s], in how many ticks, and the action taken or the reason."""

    what: str
    why: str
    ticks: int
    t: float


def happened(recording: Recording) -> Iterator[Happening]:
    """Yield problems by kind, contacts, and the largest changes of the command with their causes.

    Changes count from the step from which the metrics count. Their causes need the robot's
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
