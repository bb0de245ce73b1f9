"""The scene `stand` as plain numbers, and what an answer to it is. Needs only numpy."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Circle = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], float]


class Answer(NamedTuple):
    """What a package wants of the robot at one state.

    a (n,) accelerations; torques (n - 6,) [N m]; wrenches (feet, 6): force [N] and moment [N m]
    about the middle of each sole, on the robot, in world axes.
    """

    a: Array
    torques: Array
    wrenches: Array


class Adapter(Protocol):
    """One package, set up for the scene. `Adapter(scene, **options)` makes it."""

    package: str
    """Its name on PyPI."""
    priorities: str
    """How its priorities work, in a few words."""

    def tick(self, t: float, q: Array, v: Array, targets: Array) -> None:
        """Do one whole tick, which is timed; any exception is a failure.

        q (n + 1,) with the base's position and quaternion (x, y, z, w) first, v (n,) with the
        base's velocity in its own axes; targets (3, 3, 3) of the centre of mass and both hands:
        position, velocity, acceleration.
        """

    def answer(self) -> Answer:
        """Return the answer of the last tick; not timed."""

    # def resolve(self) -> object: solve the last tick's problem again, nothing else; optional


@final
@dataclass(frozen=True)
class Gains:
    """Stiffness [1/s^2], damping [1/s], and weight of the rows where there are no levels."""

    stiffness: float
    damping: float
    weight: float = 1.0


@final
@dataclass(frozen=True)
class Stand:
    """A humanoid on two soles: circles of its centre of mass and hands, a posture, least forces.

    file : the URDF; joints : their names, in the order of the posture (n - 6,) [rad] and torque
    limits (n - 6,) [N m]; soles, hands : frames. half : of length and width of a sole [m].
    friction : of the pyramid's faces, f_t <= friction f_n along each axis of the sole.
    circles : centre, cosine, sine (3,) [m] and rate [rad/s] of centre of mass, left and right hand.
    rest (n + 1,) : where the soles touch the floor.
    """

    file: str
    joints: tuple[str, ...]
    soles: tuple[str, ...]
    hands: tuple[str, ...]
    rest: tuple[float, ...]
    posture: tuple[float, ...]
    torque: tuple[float, ...]
    circles: tuple[Circle, ...]
    half: tuple[float, float] = (0.105, 0.04)
    friction: float = 0.4
    contact: Gains = Gains(100.0, 20.0)
    com: Gains = Gains(40.0, 13.0)
    hand: Gains = Gains(100.0, 20.0)
    joint: Gains = Gains(30.0, 11.0, 0.3)
    force: float = 3e-3
    period: float = 1e-3

    @property
    def corners(self) -> Array:
        """The corners of a sole in its frame (4, 3) [m]."""
        x, y = self.half
        return np.array([[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]])

    def targets(self, t: float) -> Array:
        """Position, velocity, acceleration of centre of mass and hands at t [s]: (3, 3, 3)."""
        found = []
        for centre, cosine, sine, rate in self.circles:
            c, s = np.cos(rate * t) * np.array(cosine), np.sin(rate * t) * np.array(sine)
            dc, ds = -np.sin(rate * t) * np.array(cosine), np.cos(rate * t) * np.array(sine)
            found.append([np.array(centre) + c + s, rate * (dc + ds), -(rate**2) * (c + s)])
        return np.array(found)


def write_stand(scene: Stand, file: Path) -> None:
    """Write a scene as JSON."""
    file.write_text(json.dumps(asdict(scene)))


def read_stand(file: Path) -> Stand:
    """Read what `write_stand` wrote."""
    fields: dict[str, Any] = json.loads(file.read_text())
    fields = {key: Gains(**value) if isinstance(value, dict) else _tuples(value)
              for key, value in fields.items()}
    return Stand(**fields)


def _tuples(value: Any) -> Any:
    return tuple(_tuples(one) for one in value) if isinstance(value, list) else value


def wrench(rotation: Array, points: Array, forces: Array) -> Array:
    """Return the wrench (6,) in world axes of forces (p, 3) at points (p, 3), both in a frame."""
    return np.concatenate([rotation @ forces.sum(axis=0),
                           rotation @ np.cross(points, forces).sum(axis=0)])
