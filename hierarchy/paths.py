"""Paths in space as functions of time: position, velocity and acceleration."""

# mypy: disable-error-code="no-untyped-def"

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import cos, inf, sin

import numpy as np

from hierarchy.errors import HierarchyError
from hierarchy.jit import bind, compiled
from hierarchy.problem import Array

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
        _check("position", self.position)

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
            _check(name, getattr(self, name))
        if not abs(self.rate) < inf:
            raise HierarchyError(f"ellipse: rate {self.rate} is not finite")
        object.__setattr__(self, "_packed", np.array([self.centre, self.cosine, self.sine],
                                                     dtype=float))

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        _write_ellipse(self._packed, self.rate, out, t)

    def writer(self, out: Array) -> Callable[[float], object]:
        """See `Path.writer`."""
        return bind(_write_ellipse, self._packed, self.rate, out, then=(0.0,))


@dataclass(frozen=True)
class Waypoints(Path):
    """Straight lines between points, quintic in time, at rest at every point.

    `times` (N,) [s] increasing, `points` (N, 3) [m]; before the first and after the last it rests.
    """

    times: Sequence[float]
    points: Sequence[Vector]

    def __post_init__(self) -> None:
        if len(self.times) != len(self.points) or not self.times:
            raise HierarchyError(f"waypoints: {len(self.times)} times for "
                                 f"{len(self.points)} points")
        if any(b <= a for a, b in zip(self.times, self.times[1:], strict=False)):
            raise HierarchyError(f"waypoints: times must increase, got {list(self.times)}")
        for i, point in enumerate(self.points):
            _check(f"points[{i}]", point)

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        i = int(np.searchsorted(self.times, t, side="right"))
        out[1:] = 0.0
        if i == 0 or i == len(self.times):
            out[0] = self.points[min(i, len(self.times) - 1)]
            return
        span = self.times[i] - self.times[i - 1]
        s = (t - self.times[i - 1]) / span
        start = np.asarray(self.points[i - 1], dtype=float)
        step = np.asarray(self.points[i], dtype=float) - start
        out[0] = start + step * (s**3 * (10 - 15 * s + 6 * s * s))
        out[1] = step * (30 * s * s * (1 - s) ** 2 / span)
        out[2] = step * (60 * s * (1 - s) * (1 - 2 * s) / span**2)


@dataclass(frozen=True)
class Shifted(Path):
    """Another path, shifted by `offset` (3,) [m]."""

    path: Path
    offset: Vector

    def __post_init__(self) -> None:
        _check("offset", self.offset)

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
        if not 0.0 <= self.amplitude < inf or not 0.0 < self.rate < inf or self.seed < 0:
            raise HierarchyError(f"jitter: amplitude {self.amplitude}, rate {self.rate}, seed "
                                 f"{self.seed}, expected numbers >= 0, > 0 and >= 0")
        random = np.random.default_rng(self.seed)
        speeds = 2.0 * np.pi * self.rate * random.uniform(0.5, 1.0, (3, 5))  # rad/s
        object.__setattr__(self, "_sines", np.stack(
            [speeds, random.uniform(0.0, 2.0 * np.pi, (3, 5))]))

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        self.path.write(t, out)
        speeds, phases = self._sines
        angles, size = speeds * t + phases, self.amplitude / speeds.shape[1]
        out[0] += size * np.sin(angles).sum(axis=1)
        out[1] += size * (speeds * np.cos(angles)).sum(axis=1)
        out[2] -= size * (speeds**2 * np.sin(angles)).sum(axis=1)


def _check(name: str, vector: Vector) -> None:
    array = np.asarray(vector, dtype=float)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise HierarchyError(f"{name} must be three finite numbers [m], got {list(vector)}")


@compiled
def _write_ellipse(packed, rate, out, t):
    c, s = cos(rate * t), sin(rate * t)
    for i in range(3):
        along = packed[1, i] * c + packed[2, i] * s
        out[0, i] = packed[0, i] + along
        out[1, i] = rate * (packed[2, i] * c - packed[1, i] * s)
        out[2, i] = -rate * rate * along
