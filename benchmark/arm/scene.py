"""The problem for all entrants as plain numbers. Needs only numpy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Vector = tuple[float, ...]


class RefusedError(Exception):
    """Raised by an adapter whose package reports failure without an exception."""


class Adapter(Protocol):
    """One package, set up for a scene. `Adapter(scene, posture, **options)` makes it.

    scene : what is asked; posture : whether the posture is asked for at all.
    """

    package: str
    """Its name on PyPI."""
    priorities: str
    """Whether its priorities are strict, in a few words."""
    rows: str
    """Which inequality rows it supports, in a few words."""

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """Return joint velocities (n,): one whole tick.

        q, v (n,) joint positions, and the velocities with which they were reached; goal (3,) [m]
        and rate (3,) [m/s] of the path at t [s]. Any exception is a failure.
        """

    # def resolve(self) -> object: solve the last tick's problem again, nothing else; optional


@final
@dataclass(frozen=True)
class Scene:
    """An arm, a path for its end effector, a posture of lower priority, velocity limits.

    file : the URDF; frame : its end effector; joints : their names.
    centre, cosine, sine (3,) [m], turning [rad/s] : the path, centre + cosine cos + sine sin.
    start (n,) [rad]; limit (n,) [rad/s]; gain, posture_gain [1/s] : a velocity asked for is the
    path's (the posture's is zero) and gain times the error. ratio : of weights or costs of
    position to posture, for those that have no levels; period [s].
    """

    file: str
    frame: str
    joints: tuple[str, ...]
    start: Vector
    limit: Vector
    posture: Vector
    centre: Vector
    cosine: Vector = (0.0, 0.0, 0.0)
    sine: Vector = (0.0, 0.0, 0.0)
    turning: float = 0.0
    gain: float = 20.0
    posture_gain: float = 5.0
    ratio: float = 1000.0
    period: float = 1e-3

    def target(self, t: float) -> tuple[Array, Array]:
        """Position (3,) [m] and velocity (3,) [m/s] of the path at t [s]."""
        c, s = np.cos(self.turning * t), np.sin(self.turning * t)
        cosine, sine = np.asarray(self.cosine), np.asarray(self.sine)
        return (np.asarray(self.centre) + c * cosine + s * sine,
                self.turning * (c * sine - s * cosine))


def scene_of(numbers: dict[str, Any]) -> Scene:
    """Return the scene of `dataclasses.asdict`, after JSON."""
    fields: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value
                              for key, value in numbers.items()}
    return Scene(**fields)
