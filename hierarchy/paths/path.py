"""Paths in space as functions of time: ellipses, lines, blends and recorded motions."""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from math import cos, inf, sin
from pathlib import Path as File
from typing import Annotated

import numpy as np

from hierarchy.errors import (
    SEEDS,
    brief,
    expect,
    file_path,
    finite_numbers,
    naming,
    number,
    positive,
    refuse,
    whole,
)
from hierarchy.gate import axes_along
from hierarchy.jit import bind, compiled, inlined
from hierarchy.problem import Array
from hierarchy.records import NotNegative, Positive, Vector3, check_fields, set_frozen

Vector = Sequence[float]
_NUMBER = "+-.0123456789"  # how one may begin
_BRIEFEST = 1e-100         # [s] blend, of which powers must not underflow


class Path(ABC):
    """A point that moves in space. Abstract."""

    @abstractmethod
    def write(self, t: float, out: Array) -> None:
        """Write position [m], velocity [m/s], acceleration [m/s^2] at t [s] as rows of (3, 3)."""

    def writer(self, out: Array) -> Callable[[float], object]:
        """Return a function of t [s] that does `write` into `out` (3, 3)."""
        return lambda t: self.write(t, out)

    def __call__(self, t: float) -> Array:
        """Position, velocity and acceleration at t [s] as rows of a new (3, 3) array.

        Raises HierarchyError unless t is a finite number.
        """
        out = np.zeros((3, 3))
        self.write(number("path: t [s]", t), out)
        return out


@dataclass(frozen=True)
class Still(Path):
    """A point at rest, `position` (3,) [m]; what is written into an array moves it."""

    position: Annotated[Vector3, "m"]

    def __post_init__(self) -> None:
        check_fields(self, "still")

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        out[0] = self.position
        out[1:] = 0.0


@dataclass(frozen=True)
class Ellipse(Path):
    """p(t) = centre + cosine cos(rate t) + sine sin(rate t); vectors [m], rate [rad/s]."""

    centre: Annotated[Vector3, "m"]
    cosine: Annotated[Vector3, "m"]
    sine: Annotated[Vector3, "m"]
    rate: Annotated[float, number] = 1.0
    _packed: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        check_fields(self, "ellipse")
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
    finite_numbers("centre [m]", centre, 3)
    number("circle: radius [m]", radius, 0.0)
    number("circle: phase [rad]", phase)
    x, y, _ = axes_along("circle: normal", normal)
    c, s = cos(phase), sin(phase)
    return Ellipse(centre, tuple((radius * (c * x + s * y)).tolist()),
                   tuple((radius * (c * y - s * x)).tolist()), rate)


@dataclass(frozen=True)
class Shifted(Path):
    """Another path, shifted by `offset` (3,) [m]."""

    path: Path
    offset: Annotated[Vector3, "m"]

    def __post_init__(self) -> None:
        check_fields(self, "shifted")
        expect("shifted: path", self.path, Path, "see hierarchy.paths")

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
    amplitude: NotNegative
    rate: Annotated[Positive, "Hz"]
    seed: Annotated[int, partial(whole, largest=SEEDS)]
    _sines: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        check_fields(self, "jitter")
        expect("jitter: path", self.path, Path, "see hierarchy.paths")
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


@compiled
def _write_ellipse(packed, rate, out, t):
    c, s = cos(rate * t), sin(rate * t)
    for i in range(3):
        along = packed[1, i] * c + packed[2, i] * s
        out[0, i] = packed[0, i] + along
        out[1, i] = rate * (packed[2, i] * c - packed[1, i] * s)
        out[2, i] = -rate * rate * along


def line(start: Vector, end: Vector, duration: float, begin: float = 0.0) -> Waypoints:
    """Return the straight line from `start` to `end` [m] within `duration` [s], from `begin` [s].

    It is quintic in time and rests before and after.
    """
    positive("line: duration [s]", duration)
    number("line: begin [s]", begin)
    return Waypoints((begin, begin + duration), (start, end))


@dataclass(frozen=True)
class _Pieces(Path):
    """One polynomial after another, at rest before the first. Abstract: needs `_keep`."""

    times: Sequence[float]
    points: Sequence[Vector]
    _starts: list[float] = field(init=False, repr=False, compare=False)
    _spans: list[float] = field(init=False, repr=False, compare=False)
    _powers: Array = field(init=False, repr=False, compare=False)  # (K, d + 1, 3)

    def _keep(self, starts: Array, *powers: Array) -> None:
        """Keep K polynomials of the share of a piece, (K, 3) for each power; the last rests."""
        set_frozen(self, _starts=starts.tolist(), _spans=[*np.diff(starts).tolist(), 1.0],
                   _powers=np.stack(powers, axis=1))

    def write(self, t: float, out: Array) -> None:
        """See `Path.write`."""
        k = max(bisect_right(self._starts, t) - 1, 0)
        _write_piece(self._powers[k], self._spans[k], float(t - self._starts[k]), out)


@compiled
def _write_piece(powers, span, since, out):
    for i in range(3):
        value, slope, bend = polynomial(powers[:, i], max(since, 0.0) / span)
        out[0, i], out[1, i], out[2, i] = value, 0.0, 0.0
        if since >= 0.0:
            out[1, i], out[2, i] = slope / span, bend / (span * span)


@inlined
def polynomial(c, x):
    """Value, derivative and second derivative of sum_i c_i x^i."""
    value, slope, bend = 0.0, 0.0, 0.0
    for i in range(len(c) - 1, -1, -1):
        bend = bend * x + 2.0 * slope
        slope = slope * x + value
        value = value * x + c[i]
    return value, slope, bend


@dataclass(frozen=True)
class Waypoints(_Pieces):
    """Straight lines between points, quintic in time, at rest at every point.

    `times` (N,) [s] increasing, `points` (N, 3) [m]; before the first and after the last it rests.
    """

    def __post_init__(self) -> None:
        times, points = _checked("waypoints", self.times, self.points)
        step = np.diff(points, axis=0, append=points[-1:])
        self._keep(times, points, 0.0 * step, 0.0 * step, 10.0 * step, -15.0 * step, 6.0 * step)


@dataclass(frozen=True)
class Blended(_Pieces):
    """Straight lines at constant speed between points, blended at each: it does not stop there.

    `times` (N,) [s] increasing, `points` (N, 3) [m]. Within `blend` [s] the velocity of one line
    becomes that of the next, quintic in time, so that the acceleration is continuous. It rests
    until the first time, and rests from times[N - 1] + blend on. It passes point i at times[i] +
    blend / 2, at 5/64 blend times the change of velocity from it.

    Raises HierarchyError for points and times that do not fit, or a blend longer than an interval.
    """

    blend: float

    def __post_init__(self) -> None:
        times, points = _checked("blended waypoints", self.times, self.points)
        shortest = min(np.diff(times), default=inf)
        T = number("blended waypoints: blend [s]", self.blend)
        refuse(not _BRIEFEST <= T <= shortest, f"blended waypoints: blend {T} s must be at least "
               f"{_BRIEFEST:g} s, and at most {shortest:g} s, the shortest interval")
        spans = np.diff(times, append=times[-1] + T + 1.0)[:, None]
        after = np.diff(points, axis=0, append=points[-1:]) / spans
        before, none = np.vstack([np.zeros(3), after[:-1]]), np.zeros_like(points)
        change = (after - before) * T
        # Of each point the blend around it, then the line to the next.
        blends = (points - before * T / 2, before * T, none, none, 2.5 * change, -3.0 * change,
                  change)
        lines = (points + after * T / 2, after * (spans - T), *[none] * 5)
        self._keep(np.column_stack([times, times + T]).ravel(),
                   *(np.hstack(pair).reshape(-1, 3) for pair in zip(blends, lines, strict=True)))


@dataclass(frozen=True)
class Recorded(_Pieces):
    """A recorded motion: the cubic spline through points, at rest at both ends.

    `times` (N,) [s] increasing, N >= 2, `points` (N, 3) [m]; before the first and after the last it
    rests. Position and velocity are continuous, the acceleration too but at the ends.
    """

    def __post_init__(self) -> None:
        times, points = _checked("recorded path", self.times, self.points)
        refuse(len(times) < 2, "recorded path: one point is no motion; use a path of kind still")
        from scipy.interpolate import CubicSpline

        spans, ends = np.diff(times)[:, None], [points[-1], *np.zeros((3, 3))]
        powers = CubicSpline(times, points, bc_type="clamped").c[::-1]
        self._keep(times, *(np.vstack([power * spans**k, ends[k]])
                            for k, power in enumerate(powers)))

    @classmethod
    def from_csv(cls, file: str | File) -> Recorded:
        """Read a file with the columns t [s], x, y, z [m], with or without a line of names.

        Raises HierarchyError, naming the file and the line, if it is not that.
        """
        with naming(f"{file} cannot be read", of=(OSError, UnicodeDecodeError)):
            text = file_path("recorded path: file", file).read_text(encoding="utf-8-sig")
        rows: list[list[float]] = []
        for count, line_ in enumerate(map(str.strip, text.splitlines()), 1):
            if not line_:
                continue
            try:
                numbers = [float(part) for part in line_.split(",")]
            except ValueError:
                if not rows and line_[0] not in _NUMBER:  # names of columns
                    continue
                numbers = []
            refuse(len(numbers) != 4, f"{file}, line {count}: expected t, x, y, z, got {line_!r}")
            rows.append(numbers)
        with naming(str(file)):
            return cls([row[0] for row in rows], [row[1:] for row in rows])


def _checked(what: str, times: Sequence[float], points: Sequence[Vector]) -> tuple[Array, Array]:
    for name, given in (("times", times), ("points", points)):
        refuse(isinstance(given, str) or not isinstance(given, Sequence | np.ndarray)
               or getattr(given, "shape", None) == (),
               f"{what}: {name}: expected a list, got {brief(given)}")
    refuse(len(times) != len(points) or not len(times), f"{what}: {len(times)} times for "
           f"{len(points)} points")
    for a, b in pairwise([number(f"{what}: times[{i}]", time) for i, time in enumerate(times)]):
        refuse(not a < b, f"{what}: times must increase, got {a} and then {b}")
        refuse(not 0.0 < (b - a) * (b - a) < inf, f"{what}: times are too near or too far apart, "
               f"got {a} and then {b}")
    for i, point in enumerate(points):
        finite_numbers(f"points[{i}] [m]", point, 3)
    return np.array(times, dtype=float), np.array(points, dtype=float)
