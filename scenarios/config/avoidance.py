"""The keys of [avoidance]: obstacles, thresholds, repulsion or separation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from hierarchy.avoidance import Barrier, Obstacle, Repulsion
from hierarchy.problem import Array
from hierarchy.words import listed
from scenarios.config.paths import PathSection, WaypointsSection
from scenarios.config.sections import (
    Count,
    Distance,
    Length,
    OneOf,
    Point,
    Positive,
    Rate,
    Rows3,
    Section,
    Speed,
    Unit,
)


class RepulsionSection(Section):
    """Magnitude of the repulsion over the distance, eq. (23); see hierarchy.avoidance.Repulsion."""

    maximum: Positive
    """Magnitude at distance zero, in [m/s^2] at acceleration level, [m/s] at velocity level."""
    reach: Length
    """Distance at which the magnitude is nearly zero, rho."""
    shape: Positive
    """Steepness of the magnitude over the distance, gamma; it has no unit."""
    scale: Positive = 2.0
    """Factor of the distance; 2 is eq. (23), the authors' code has 3 (body), 1.5 (end effector)."""

    def make(self) -> Repulsion:
        """Return the law."""
        return Repulsion(self.maximum, self.reach, self.shape, self.scale)


class ObstacleSection(Section):
    """An obstacle: a shape at a place, or on a path."""

    tag: ClassVar[str] = "shape"
    shape: Literal["point", "sphere", "capsule", "box"] = "point"
    """What it is; a list [x, y, z] in place of the table is a point."""
    centre: Point | None = None
    """Its middle, for one that does not move."""
    radius: Length | None = None
    """Of a sphere or a capsule."""
    half_length: Length | None = None
    """Of a capsule: half the segment along its z axis, without the round ends."""
    half_lengths: tuple[Length, Length, Length] | None = None
    """Of a box: half its sides along its x, y and z axes."""
    rotation: Rows3 = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    """Rows of the matrix from its axes to the world's."""
    path: PathSection | None = None
    """Path of its middle, for one that moves."""

    def _wrong(self) -> Iterator[str]:
        needs = {"point": (), "sphere": ("radius",), "capsule": ("radius", "half_length"),
                 "box": ("half_lengths",)}[self.shape]
        for key in ("radius", "half_length", "half_lengths"):
            if (getattr(self, key) is None) == (key in needs):
                yield f"a {self.shape} takes {listed(needs) if needs else 'no size'}"
        if (self.centre is None) == (self.path is None):
            yield "give either a centre or a path"

    def make(self, name: str) -> Obstacle:
        """Return the obstacle, with its name in messages."""
        sizes = (self.radius, self.half_length, *(self.half_lengths or ()))
        return Obstacle(self.shape, self.centre or (0.0, 0.0, 0.0),
                        tuple(float(size) for size in sizes if size is not None),
                        np.array(self.rotation),
                        None if self.path is None else self.path.make(), name)


def as_table(obstacle: Any) -> Any:
    """Return the table of an obstacle; [x, y, z] is a point."""
    return {"centre": obstacle} if isinstance(obstacle, list | tuple) else obstacle


Obstacles = tuple[Annotated[ObstacleSection, BeforeValidator(as_table)], ...]


class VariationSection(Section):
    """Random variation of obstacle paths that have waypoints; other obstacles do not change."""

    seed: Count
    """Seed of the variation."""
    spread: Distance = 0.05
    """Largest displacement of a waypoint, in any direction; consecutive equal waypoints, at which
    an obstacle rests, move together."""
    timing: Annotated[float, Field(strict=True, ge=0.0, lt=1.0)] = 0.1
    """Largest shift of each time except the first, as a share of half the shorter interval beside
    it."""


def _varied(obstacle: ObstacleSection, variation: VariationSection,
            number: int) -> ObstacleSection:
    """Return the obstacle with its waypoints moved, each obstacle with its own random numbers."""
    path = obstacle.path
    if not isinstance(path, WaypointsSection):
        return obstacle
    random = np.random.default_rng((variation.seed, number))
    times, points = np.array(path.times), np.array(path.points)
    away = points + variation.spread * _in_ball(random, len(points))
    for i in range(1, len(points)):
        if (points[i] == points[i - 1]).all():  # it rests where it rested
            away[i] = away[i - 1]
    half = np.diff(times) / 2  # times still increase; the first is unchanged
    room = np.concatenate([[0.0], np.minimum(half[:-1], half[1:]), half[-1:]])
    times = times + variation.timing * room * random.uniform(-1.0, 1.0, len(times))
    waypoints = {"times": tuple(times.tolist()), "points": tuple(map(tuple, away.tolist()))}
    return obstacle.model_copy(update={"path": path.model_copy(update=waypoints)})


def _in_ball(random: np.random.Generator, count: int) -> Array:
    """Return random points (count, 3), uniform in the unit ball."""
    points = random.standard_normal((count, 3))
    radii = random.random((count, 1)) ** (1 / 3)
    return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True) * radii)


class _Avoiding(Section):
    obstacles: Obstacles
    """What is to be avoided: tables, or points [x, y, z]."""
    variation: VariationSection | None = None
    """Random variation of the obstacles' paths."""

    @property
    def placed(self) -> Obstacles:
        """The obstacles, on varied paths if there is a `variation`."""
        if self.variation is None:
            return self.obstacles
        return tuple(_varied(obstacle, self.variation, number)
                     for number, obstacle in enumerate(self.obstacles))

    def _wrong(self) -> Iterator[str]:
        moves = self.variation is not None and self.variation.spread + self.variation.timing > 0.0
        if moves and not any(isinstance(obstacle.path, WaypointsSection)
                             for obstacle in self.obstacles):
            yield "variation needs an obstacle with waypoints"


class AvoidanceSection(_Avoiding):
    """Avoidance for the body and repulsion of the end effector, switched by Algorithm 1."""

    kind: Literal["repulsion"] = "repulsion"
    dimension: Literal[1, 3] = 1
    """Rows of the body's avoidance: 1 along the direction of the obstacle, or 3."""
    direction: Literal["nearest", "mean"] = "nearest"
    """"nearest": away from the nearest obstacle. "mean": along the mean (25)-(26) over the
    obstacles within `far` of a control point, and within `end_effector` of the end effector."""
    near: Distance
    """Distance of the body below which its avoidance comes before the position, eps_1."""
    far: Distance
    """Distance of the body below which it avoids at all, eps_2; at least `near`."""
    end_effector: Distance
    """Distance of the end effector below which it is repelled, eps_ee."""
    body: RepulsionSection
    """Repulsion of the body."""
    tip: RepulsionSection
    """Repulsion of the end effector."""
    jacobian: Literal["exact", "published"] = "exact"
    """"published": that of the published code, with its error."""
    place: Literal["stack", "null-space"] = "stack"
    """"null-space": the null-space term is the sum of the repulsion of all control points within
    `far`, as joint commands, and `near` has no effect, see hierarchy.tasks.CumulatedRepulsion."""
    asked: Length | None = None
    """Distance that metrics check for body and end effector, without effect on the run; by
    default `near`, for the body."""

    def _wrong(self) -> Iterator[str]:
        yield from super()._wrong()
        if self.place == "null-space" and self.jacobian == "published":
            yield 'place = "null-space" goes with jacobian = "exact"'
        if self.near > self.far:
            yield f"near = {self.near} m is beyond far = {self.far} m"

    @property
    def thresholds(self) -> dict[str, float]:
        """Distances of the body [m] at which avoidance changes, by symbol."""
        if self.place == "null-space":
            return {r"$\epsilon_2$": self.far}
        outer = {r"$\epsilon_2$": self.far} if self.far > self.near else {}
        return {r"$\epsilon_1$": self.near} | outer

    @property
    def tip_thresholds(self) -> dict[str, float]:
        """The same for the end effector."""
        return {r"$\epsilon_{ee}$": self.end_effector}

    @property
    def promised(self) -> dict[str, float]:
        """Distances [m] to be kept; eps_1 of the body, below which its avoidance comes first."""
        return {"body": self.near} if self.asked is None else {"body": self.asked, "ee": self.asked}


class BarrierSection(Section):
    """How one-sided rows keep a distance, see hierarchy.avoidance.Barrier."""

    distance: Distance = 0.03
    """Clearance to keep."""
    rate: Rate = 10.0
    """Limit of the approach to the clearance: speed per distance that is left."""
    influence: Length = 0.3
    """Distance beyond which there is no effect; above `distance`."""
    recovery: Speed = 0.2
    """Speed of the retreat below the clearance, at most."""
    limit: Annotated[Positive, Unit("m/s^2")] = 50.0
    """Acceleration of the retreat, at most."""

    def barrier(self, distance: float) -> Barrier:
        """Return the barrier of a distance [m] to keep; HierarchyError if it is out of range."""
        return Barrier(distance, self.rate, self.influence, self.recovery, self.limit)


class SeparationSection(BarrierSection, _Avoiding):
    """Keep all control points and the end effector away from all obstacles, as one-sided rows.

    With control.stack = "set-based" only the clearances apply. With "smooth" the rate of the rows
    toward the end of `buffer` is `rate` times what is missing, at most `recovery`. See
    hierarchy.avoidance.Barrier.
    """

    kind: Literal["separation"]
    self_collision: Distance | None = None
    """Clearance between links that are not neighbours; without it links may collide."""
    buffer: Length | None = None
    """With control.stack = "smooth": width outside the clearance within which rows act."""
    obstacles: Obstacles = ()

    def _wrong(self) -> Iterator[str]:
        yield from super()._wrong()
        if self.distance >= self.influence:
            yield f"distance = {self.distance} m is not below influence = {self.influence} m"

    @property
    def thresholds(self) -> dict[str, float]:
        """Distances of the body [m] at which avoidance changes, by symbol."""
        return {r"$d_{min}$": self.distance}

    @property
    def tip_thresholds(self) -> dict[str, float]:
        """The same for the end effector."""
        return self.thresholds

    @property
    def promised(self) -> dict[str, float]:
        """Distances [m] to be kept, of the body and of the end effector, "ee"."""
        return {"body": self.distance, "ee": self.distance}


AvoidanceKind = Annotated[AvoidanceSection | SeparationSection, OneOf("repulsion")]
