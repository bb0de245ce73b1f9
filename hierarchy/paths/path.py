"""Paths in space as functions of time: position, velocity and acceleration."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import cos, inf, sin

import numpy as np

from hierarchy.errors import HierarchyError, expect, finite_numbers, number
from hierarchy.jit import bind, compiled
from hierarchy.problem import Array
from hierarchy.records import set_frozen

Vector = Sequence[float]


class Path(ABC):
    """A point that moves in space. Abstract."""

    @abstractmethod
    def write(self, t: float, out: Array) -> None:
        """Write position [m], velocity [m/s], acceleration [m/s^2] at t [s] as rows of (3, 3)."""

    def writer(self, out: Array) -> Callable[[float], object]:
        """Return a function of t [s] that does `write` into `out` (3, 3)."""
        return lambda t: self.write(t, out)

    def __call__(self, t: float) -> Array:
        """Position, velocity and acceleration at t [s] as rows of a new (3, 3) array."""
        out = np.empty((3, 3))
        self.write(t, out)
        return out


@dataclass(frozen=True)
class Still(Path):
    """A point at rest, `position` (3,) [m]."""

    position: Vector

    def __post_init__(self) -> None:
        check_point("position", self.position)

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        out[0] = self.position
        out[1:] = 0.0


@dataclass(frozen=True)
class Ellipse(Path):
    """p(t) = centre + cosine cos(rate t) + sine sin(rate t); vectors [m], rate [rad/s]."""

    centre: Vector
    cosine: Vector
    sine: Vector
    rate: float = 1.0
    _packed: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("centre", "cosine", "sine"):
            check_point(name, getattr(self, name))
        number("ellipse: rate", self.rate)
        set_frozen(self, _packed=np.array([self.centre, self.cosine, self.sine], dtype=float))

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        _write_ellipse(self._packed, self.rate, out, t)

    def writer(self, out: Array) -> Callable[[float], object]:
        """See `Path.writer`."""
        return bind(_write_ellipse, self._packed, self.rate, out, then=(0.0,))


def circle(centre: Vector, radius: float, normal: Vector = (0.0, 0.0, 1.0), rate: float = 1.0,
           phase: float = 0.0) -> Ellipse:
    """Return a circle of `radius` [m] about `normal` (3,); rate [rad/s], phase [rad].

    It starts, at phase zero, in the direction of the world's x axis as seen in its plane, or of y
    where the normal is along x. Raises HierarchyError for a radius < 0 or a normal of length zero.
    """
    check_point("centre", centre)
    z = np.array(normal, dtype=float)
    length = float(np.linalg.norm(z))
    if z.shape != (3,) or not 1e-9 < length < inf or not 0.0 <= radius < inf:
        raise HierarchyError(f"circle: radius {radius} and normal {list(normal)}, expected a "
                             "number >= 0 and a direction")
    z = z / length
    toward = np.eye(3)[1 if abs(z[0]) > 0.9 else 0]
    x = toward - (toward @ z) * z
    x, y = x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x))
    c, s = cos(phase), sin(phase)
    return Ellipse(centre, tuple((radius * (c * x + s * y)).tolist()),
                   tuple((radius * (c * y - s * x)).tolist()), rate)


@dataclass(frozen=True)
class Shifted(Path):
    """Another path, shifted by `offset` (3,) [m]."""

    path: Path
    offset: Vector

    def __post_init__(self) -> None:
        check_point("offset", self.offset)

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        self.path.write(t, out)
        out[0] += self.offset

    def writer(self, out: Array) -> Callable[[float], object]:
        """See `Path.writer`."""
        follow, offset = self.path.writer(out), np.asarray(self.offset, dtype=float)

        def write(t: float) -> None:
            follow(t)
            out[0] += offset

        return write


@dataclass(frozen=True)
class Jittered(Path):
    """Another path plus a small, smooth, random motion that depends on `seed` and t alone.

    In each axis the motion is the mean of five sines with random phases and frequencies between
    rate / 2 and rate, times `amplitude`, which bounds it. Its derivatives are part of the path's.

    amplitude : >= 0 [m]. rate : > 0 [Hz]. seed : whole number >= 0.
    """

    path: Path
    amplitude: float
    rate: float
    seed: int
    _sines: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("amplitude", "rate", "seed"):
            number(f"jitter: {name}", getattr(self, name))
        expect("jitter: path", self.path, Path, "see hierarchy.paths")
        if not 0.0 <= self.amplitude or not 0.0 < self.rate or self.seed < 0:
            raise HierarchyError(f"jitter: amplitude {self.amplitude}, rate {self.rate}, seed "
                                 f"{self.seed}, expected numbers >= 0, > 0 and >= 0")
        random = np.random.default_rng(self.seed)
        speeds = 2.0 * np.pi * self.rate * random.uniform(0.5, 1.0, (3, 5))  # rad/s
        set_frozen(self, _sines=np.stack([speeds, random.uniform(0.0, 2.0 * np.pi, (3, 5))]))

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        self.path.write(t, out)
        speeds, phases = self._sines
        angles, size = speeds * t + phases, self.amplitude / speeds.shape[1]
        out[0] += size * np.sin(angles).sum(axis=1)
        out[1] += size * (speeds * np.cos(angles)).sum(axis=1)
        out[2] -= size * (speeds**2 * np.sin(angles)).sum(axis=1)


def check_point(name: str, vector: Vector) -> None:
    """Raise a HierarchyError unless a vector is three finite numbers, or return None."""
    try:
        finite_numbers(name, vector, 3)
    except HierarchyError as error:
        given = list(vector) if isinstance(vector, list | tuple | np.ndarray) else vector
        raise HierarchyError(f"{name} must be three finite numbers [m], got {given!r}") from error


@compiled
def _write_ellipse(packed, rate, out, t):
    c, s = cos(rate * t), sin(rate * t)
    for i in range(3):
        along = packed[1, i] * c + packed[2, i] * s
        out[0, i] = packed[0, i] + along
        out[1, i] = rate * (packed[2, i] * c - packed[1, i] * s)
        out[2, i] = -rate * rate * along
