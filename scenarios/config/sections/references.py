"""What the names in sections refer to: frames, joints, contacts and capsules of the robot."""

from collections.abc import Mapping
from dataclasses import dataclass

from numpy.typing import ArrayLike

from hierarchy import Robot, State
from hierarchy.contacts import Contacts
from hierarchy.problem import Array
from hierarchy.robot import Frame
from hierarchy.tasks import Mechanism
from hierarchy.tasks.separation import separable_pairs
from scenarios.config.sections import ScenarioError, naming


@dataclass(frozen=True)
class References:
    """The robot at the start of a run, by which a section finds what it names.

    contacts : those at level "torque".
    """

    start: State
    contacts: Contacts | None = None

    @property
    def robot(self) -> Robot:
        """The robot."""
        return self.start.robot

    def frame(self, name: str | None, key: str = "frame") -> Frame:
        """Return the frame that `key` names, the end effector for None; ScenarioError if none."""
        with naming(key):
            return self.robot.frame(name or self.robot.end_effector)

    def posture(self, joints: Mapping[str, ArrayLike], q: Array) -> Array:
        """Return q (nq,) with joints by name at their values, and closed chains closed."""
        moved = self.robot.configuration(joints, q)
        return Mechanism(self.robot).closed(moved, joints) if joints else moved

    def pairs(self, distance: float) -> list[tuple[int, int]]:
        """Return the pairs of capsules to keep at a distance [m]; ScenarioError if none can be."""
        pairs = separable_pairs(self.robot, distance)
        if not pairs:
            raise ScenarioError(f"robot {self.robot.name!r} has no capsules that could be kept "
                                "apart; list them in robot.capsules")
        return pairs
