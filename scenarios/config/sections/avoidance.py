"""The keys of [avoidance]: obstacles, thresholds, repulsion or separation."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from hierarchy.avoidance import Barrier, Obstacle, Repulsion
from hierarchy.words import listed
from scenarios.config import sections as keys
from scenarios.config.sections import naming
from scenarios.config.sections.paths import PathSection, WaypointsSection


class RepulsionSection(keys.Section):
    """Magnitude of the repulsion over the distance, eq. (23)."""

    maximum: keys.Positive  #: Magnitude at distance zero, in [m/s^2], or [m/s] at velocity level.
    reach: keys.Length  #: rho: distance at which it is nearly zero.
    shape: keys.Positive  #: gamma: its steepness.
    scale: keys.Positive = 2.0
    """Factor of the distance: 2 in (23), in the authors' code 3 (body) and 1.5 (end effector)."""

    def make(self) -> Repulsion:
        """Return the law."""
        return Repulsion(self.maximum, self.reach, self.shape, self.scale)


class ObstacleSection(keys.Section):
    """A shape at a place or on a path."""

    tag: ClassVar[str] = "shape"
    shape: Literal["point", "sphere", "capsule", "box"] = "point"
    """A list [x, y, z] in place of the table is a point."""
    centre: keys.Point | None = None  #: Its middle, if it does not move.
    radius: keys.Length | None = None  #: Of a sphere or a capsule.
    half_length: keys.Length | None = None  #: Of a capsule: half its segment, along z.
    half_lengths: tuple[keys.Length, keys.Length, keys.Length] | None = None  #: Half a box's sides.
    rotation: keys.Rows3 = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    """Rows of the matrix from its axes to the world's."""
    path: PathSection | None = None  #: Path of its middle, if it moves.

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
        with naming(name):
            path = None if self.path is None else self.path.make()
        return Obstacle(self.shape, self.centre or (0.0, 0.0, 0.0),
                        tuple(float(size) for size in sizes if size is not None),
                        np.array(self.rotation), path, name)


def as_table(obstacle: Any) -> Any:
    """Return the table of an obstacle; [x, y, z] is a point."""
    return {"centre": obstacle} if isinstance(obstacle, list | tuple) else obstacle


Obstacles = tuple[Annotated[ObstacleSection, BeforeValidator(as_table)], ...]
Thresholds = dict[str, dict[str, float]]  # by what keeps its distance, then by symbol


class VariationSection(keys.Section):
    """Random variation of the obstacles' waypoints."""

    seed: keys.Count  #: Seed of the variation.
    spread: keys.Distance = 0.05  #: Largest shift of a waypoint; equal ones in a row move together.
    timing: Annotated[float, Field(strict=True, ge=0.0, lt=1.0)] = 0.1
    """Largest shift of a time but the first, as a share of half the shorter interval beside it."""


def _varied(obstacle: ObstacleSection, variation: VariationSection,
            number: int) -> ObstacleSection:
    """Return the obstacle with its waypoints moved, each obstacle with its own random numbers."""
    path = obstacle.path
    if not isinstance(path, WaypointsSection):
        return obstacle
    random = np.random.default_rng((variation.seed, number))
    times, points = np.array(path.times), np.array(path.points)
    within = random.standard_normal(points.shape)
    within /= np.linalg.norm(within, axis=1, keepdims=True)  # uniform in the unit ball
    away = points + variation.spread * (within * random.random((len(points), 1)) ** (1 / 3))
    for i in range(1, len(points)):
        if (points[i] == points[i - 1]).all():  # it rests where it rested
            away[i] = away[i - 1]
    half = np.diff(times) / 2  # times still increase; the first is unchanged
    room = np.concatenate([[0.0], np.minimum(half[:-1], half[1:]), half[-1:]])
    times = times + variation.timing * room * random.uniform(-1.0, 1.0, len(times))
    waypoints = {"times": tuple(times.tolist()), "points": tuple(map(tuple, away.tolist()))}
    return obstacle.model_copy(update={"path": path.model_copy(update=waypoints)})


class _Avoiding(keys.Section):
    obstacles: Obstacles  #: Tables, or points [x, y, z].
    variation: VariationSection | None = None  #: Random variation of the obstacles' paths.

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
    """Avoidance for the body, repulsion of the end effector, by Algorithm 1."""

    kind: Literal["repulsion"] = "repulsion"
    dimension: Literal[1, 3] = 1
    """Rows of the body's avoidance: along the direction of the obstacle, or all."""
    direction: Literal["nearest", "mean"] = "nearest"
    """Away from the "nearest" obstacle, or along the "mean" (25)-(26) over those within `far` of a
    control point and `end_effector` of the end effector."""
    near: keys.Distance  #: eps_1: distance below which the body's avoidance precedes the position.
    far: keys.Distance  #: Distance, eps_2, below which the body avoids at all; at least `near`.
    end_effector: keys.Distance  #: Distance, eps_ee, below which the end effector is repelled.
    body: RepulsionSection  #: Repulsion of the body.
    tip: RepulsionSection  #: Repulsion of the end effector.
    jacobian: Literal["exact", "published"] = "exact"  #: "published": with the published error.
    place: Literal["stack", "null-space"] = "stack"
    """"null-space": the repulsion of all control points within `far` is summed in the null-space
    term; `near` has no effect."""
    asked: keys.Length | None = None
    """Distance that metrics check for body and end effector; by default `near`, for the body."""

    def _wrong(self) -> Iterator[str]:
        yield from super()._wrong()
        if self.place == "null-space" and self.jacobian == "published":
            yield 'place = "null-space" goes with jacobian = "exact"'
        if self.place == "null-space" and self.dimension != 1:
            yield 'place = "null-space" goes with dimension = 1'
        if self.near > self.far:
            yield f"near = {self.near} m is beyond far = {self.far} m"

    @property
    def thresholds(self) -> Thresholds:
        """Distances [m] of the body and of the end effector, "ee", at which avoidance changes."""
        inner, outer = {r"$\epsilon_1$": self.near}, {r"$\epsilon_2$": self.far}
        body = outer if self.place == "null-space" else (
            inner | outer if self.far > self.near else inner)
        return {"body": body, "ee": {r"$\epsilon_{ee}$": self.end_effector}}

    @property
    def promised(self) -> dict[str, float]:
        """Distances [m] to be kept; eps_1 of the body, below which its avoidance comes first."""
        return {"body": self.near} if self.asked is None else {"body": self.asked, "ee": self.asked}


class BarrierSection(keys.Section):
    """How one-sided rows keep a distance, see hierarchy.avoidance.Barrier."""

    distance: keys.Distance = 0.03  #: Clearance to keep.
    rate: keys.Rate = 10.0  #: Fastest approach: speed per distance left.
    influence: keys.Length = 0.3  #: Distance beyond which nothing acts; above `distance`.
    recovery: keys.Speed = 0.2  #: Largest speed of the retreat below it.
    limit: Annotated[keys.Positive, keys.Unit("m/s^2")] = 50.0  #: Largest acceleration of retreat.

    def barrier(self, distance: float) -> Barrier:
        """Return the barrier of a distance [m] to keep; HierarchyError if it is out of range."""
        return Barrier(distance, self.rate, self.influence, self.recovery, self.limit)


class SeparationSection(BarrierSection, _Avoiding):
    """One-sided rows between all points and all obstacles.

    For control.stack = "set-based" only clearances count; for "smooth" rows approach the end of
    `buffer` by `rate` times what is missing, at most `recovery`.
    """

    kind: Literal["separation"]
    self_collision: keys.Distance | None = None
    """Clearance between links that are not neighbours, by default not kept."""
    buffer: keys.Length | None = None
    """Width outside the clearance within which rows act if control.stack is "smooth"."""
    obstacles: Obstacles = ()

    def _wrong(self) -> Iterator[str]:
        yield from super()._wrong()
        if self.distance >= self.influence:
            yield f"distance = {self.distance} m is not below influence = {self.influence} m"

    @property
    def thresholds(self) -> Thresholds:
        """Distances [m] of the body and of the end effector, "ee", at which avoidance changes."""
        return {who: {r"$d_{min}$": self.distance} for who in ("body", "ee")}

    @property
    def promised(self) -> dict[str, float]:
        """Distances [m] to be kept, of the body and of the end effector, "ee"."""
        return {"body": self.distance, "ee": self.distance}


AvoidanceKind = Annotated[AvoidanceSection | SeparationSection, keys.OneOf("repulsion")]
