"""What the names in a task's section refer to: frames, joints and contacts of the robot."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scenarios.config.errors import ScenarioError

if TYPE_CHECKING:
    from hierarchy import Robot, State
    from hierarchy.contacts import Contacts
    from hierarchy.robot import Frame

Pairs = list[tuple[int, int]]


@dataclass(frozen=True)
class References:
    """The robot at the start of a run, by which a section finds what it names.

    contacts_or_none : the contacts at level "torque". separable : gives the pairs of capsules that
    can be kept at a distance [m].
    """

    start: State
    contacts_or_none: Contacts | None
    separable: Callable[[Robot, float], Pairs]

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.start.robot

    @property
    def contacts(self) -> Contacts:
        """The contacts, of a scenario at level "torque"."""
        assert self.contacts_or_none is not None, "the level of the scenario was checked"
        return self.contacts_or_none

    def frame(self, name: str | None) -> Frame:
        """Return a frame by name, the end effector for None; raises UnknownNameError."""
        return self.robot.frame(name or self.robot.end_effector)

    def pairs(self, distance: float) -> Pairs:
        """Return the pairs of capsules to keep at a distance [m]; ScenarioError if none can be."""
        pairs = self.separable(self.robot, distance)
        if not pairs:
            raise ScenarioError(f"robot {self.robot.name!r} has no capsules that could be kept "
                                "apart; list them in robot.capsules")
        return pairs
