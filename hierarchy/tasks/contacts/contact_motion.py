"""Contacts that stay where they are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hierarchy.contacts import Contact, Contacts, zero_while_open
from hierarchy.gate import array_of
from hierarchy.paths import Still
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.state import State
from hierarchy.task import Level, Rows, Task, Writer, Written
from hierarchy.tasks.pose import Pose
from hierarchy.tasks.position import Along, Position
from hierarchy.tasks.together import Together


@dataclass(frozen=True)
class ContactMotion(Written):
    """Keep contacts at rest: J_c a + dJ_c/dt v = -damping v_c + stiffness e [m/s^2, rad/s^2].

    Three rows for a point, those of `Position`, one of them along the normal for a point that
    slides; six for a surface, those of `Pose`. With e = 0 and no damping the contact accelerates
    nowhere; damping [1/s] takes away what velocity it has, and stiffness [1/s^2] brings it back to
    its anchor. `anchors` are (4, 3) for each contact: where its point, or the frame of a surface,
    belongs [m], then the rotation of the frame; `ContactMotion.at` takes them from a state. While a
    contact is open its rows ask for nothing: a `Pose` or `Position` task swings the foot.

    Raises HierarchyError for no contacts, a stiffness without anchors, or a stiffness of a contact
    that opens, because it may come down elsewhere. Source: J. Baumgarte,
    "Stabilization of constraints and integrals of motion in dynamical systems", Computer Methods in
    Applied Mechanics and Engineering (1972).
    """

    of: Contacts
    anchors: Sequence[Array] | None = None
    stiffness: float = 0.0
    damping: float = 20.0
    gain: float = 10.0
    name: str = "contact motion"

    def __post_init__(self) -> None:
        super().__post_init__()
        self.refuse(not self.of.contacts, "there are no contacts")
        stiff = np.any(self.stiffness)
        self.refuse(self.anchors is None and stiff, f"stiffness {self.stiffness} needs anchors")
        for contact in self.of.contacts:
            self.refuse(contact.open and stiff, f"contact {contact.name!r} opens, so its "
                        f"stiffness must be 0, not {self.stiffness}")
        count = len(self.of.contacts)
        self.refuse(self.anchors is not None and array_of(
            f"task {self.name!r}: anchors", self.anchors).shape != (count, 4, 3),
            f"anchors are not (4, 3) for each of {count} contacts")

    @classmethod
    def at(cls, state: State, of: Contacts, stiffness: float = 100.0, damping: float = 20.0,
           name: str = "contact motion") -> ContactMotion:
        """Return the task that keeps contacts where they are at a state."""
        frames = [_held(contact) for contact in of.contacts]
        anchors = [np.vstack([state.position(frame), state.rotation(frame)]) for frame in frames]
        return cls(of, anchors, stiffness, damping, name=name)

    @property
    def row_names(self) -> tuple[str, ...]:
        """Contact, and axis of translation or turn, of each row."""
        axes = [f"{kind} {axis}" for kind in ("along", "about") for axis in "xyz"]
        return tuple(f"{contact.name} {axis}" for contact in self.of.contacts
                     for axis in (("along its normal",) if contact.slides else
                                  axes if contact.is_surface else axes[:3]))

    def error(self, state: State) -> Array:
        """Distance of each contact from its anchor (m,) [m, rad]; zero without anchors."""
        return np.zeros(self.dimension) if self.anchors is None else self._tasks.error(state)

    def writer(self, state: State, level: Level, rows: Rows) -> Writer:
        """See `Task.writer`."""
        tasks = self._tasks
        parts = rows.split([task.dimension for task in tasks.tasks])
        return zero_while_open(tasks.writer(state, level, rows), state, self.of, parts)

    @property
    def _tasks(self) -> Together:
        contacts, anchors = self.of.contacts, self.anchors
        anchors = [np.eye(4, 3, -1)] * len(contacts) if anchors is None else anchors
        return Together([self._task(*pair) for pair in zip(contacts, anchors, strict=True)])

    def _task(self, contact: Contact, anchor: Array) -> Task:
        frame, path, name = _held(contact), Still(anchor[0].tolist()), contact.name
        gains = self.stiffness, self.damping, 0.0 if self.anchors is None else self.gain
        if contact.is_surface:
            return Pose(frame, path, anchor[1:], *gains, name)
        point = Position(frame, path, *gains, name=name)
        return Along(point, contact.axes[2:].tolist(), name) if contact.slides else point


def _held(contact: Contact) -> Frame:
    """Return the frame whose origin is held: that of a surface, or one at the only point."""
    frame = contact.frame
    if contact.is_surface:
        return frame
    return Frame(contact.name, frame.joint, frame.placed(contact.points[0]), frame.rotation)
