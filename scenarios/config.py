"""The validated form of a scenario file, and how such a file is read."""

from __future__ import annotations

import dataclasses
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import tomli_w
from pydantic import (
    BeforeValidator,
    Discriminator,
    Field,
    Tag,
    ValidationError,
    model_validator,
)

from hierarchy.errors import HierarchyError, UnknownNameError
from hierarchy.models.names import in_package
from hierarchy.robots.table import Base
from scenarios.sections import (
    EllipseSection,
    Finite,
    ListedPointing,
    ListedTask,
    NotNegative,
    PathSection,
    Positive,
    StillSection,
    Vector3,
    WaypointsSection,
)
from scenarios.sections import Section as _Section

__all__ = ["EllipseSection", "PathSection", "Scenario", "ScenarioError", "StillSection",
           "WaypointsSection", "load", "shipped"]

if TYPE_CHECKING:
    from solvers import Resolver
    from solvers.resolver import Handles

LIBRARY = Path(__file__).parent / "library"


class ScenarioError(HierarchyError):
    """A scenario file, or a change to one, that cannot be used; names file and key."""


class ControlPointSection(_Section):
    """A point on the body that `joint` moves, `offset` [m] in that joint's frame."""

    joint: str
    offset: Vector3


class RobotPointSection(_Section):
    """A point on the body of `joint`, or fixed to `frame`, `offset` [m] in axes of that."""

    joint: str | None = None
    frame: str | None = None
    offset: Vector3 = (0.0, 0.0, 0.0)

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if (self.joint is None) == (self.frame is None):
            raise ValueError("give either a joint or a frame")
        return self


class CapsuleSection(_Section):
    """All within `radius` [m] of the segment `start` to `end` [m], in the frame of `joint`.

    Without a joint it is fixed to the base.
    """

    joint: str | None = None
    start: Vector3
    end: Vector3
    radius: NotNegative


class RobotSection(_Section):
    """Which robot: a name of `hierarchy list`, a URDF or MJCF file, or "package:name".

    Packages are example_robot_data and robot_descriptions (extra `robots`). `base` None is that of
    the model. What `end_effector`, `control_points` and `capsules` do not say is as the robot's
    table says, or for a file as `hierarchy check FILE` proposes. `locked` joints of a file are held
    at an angle [rad] or a way [m] and are no joints any more.
    """

    model: str
    base: Base | None = None
    end_effector: str | None = None
    control_points: tuple[RobotPointSection, ...] | None = None
    capsules: tuple[CapsuleSection, ...] | None = None
    locked: dict[str, Finite] = Field(default_factory=dict)


class StartSection(_Section):
    """Positions `q` [rad or m] and velocities `v`; `end_effector` [m] is reached from q first.

    Without q the robot starts in its own posture. `joints` by name go before either.
    """

    q: tuple[Finite, ...] | None = None
    joints: dict[str, Finite] = Field(default_factory=dict)
    v: tuple[Finite, ...] | None = None
    end_effector: Vector3 | None = None


AnswerPolicy = Literal["brake", "hold", "stop", "use"]
BlindPolicy = Literal["brake", "hold", "stop"]


class PolicySection(_Section):
    """What is sent in a tick with trouble, for each kind of it.

    "brake": toward rest. "hold": the last command of a tick without trouble, for at most
    `patience` ticks in a row, then brake. "stop": to rest as fast as the limits allow, where the
    run ends with a fault. "use": the answer, where there is one. In a tick with troubles of several
    kinds the last of use, hold, brake, stop that one of them asks for is done.

    The first four kinds are statuses of a resolver, see solvers.Status. not_finite: a measured
    joint state is NaN or infinite, or a distance NaN. stale: no new measurement for more than
    `stale_after` [s]; up to then the last one is carried on by the commands sent. overrun: the
    command was not there `deadline` [s] after the tick began; None for no deadline. inside: a
    point of the robot is on or inside an obstacle.
    """

    iteration_limit: AnswerPolicy = "brake"
    numerical_failure: BlindPolicy = "brake"
    backend_failure: AnswerPolicy = "brake"
    inaccurate: AnswerPolicy = "brake"
    not_finite: BlindPolicy = "brake"
    stale: BlindPolicy = "brake"
    overrun: AnswerPolicy = "brake"
    inside: AnswerPolicy = "brake"
    patience: Annotated[int, Field(ge=0)] = 10
    stale_after: NotNegative = 0.02
    deadline: Positive | None = None


class ControlSection(_Section):
    """How the tasks are resolved and how often.

    `stack` = "switched": Algorithm 1 says which tasks are in the stack, and all are equalities.
    "hierarchical": limits, avoidance, position and pointing are in it at all times, in this order,
    inequalities as inequalities.

    With `strictness` every tick is also resolved without what is below the position, outside the
    times measured, to see whether that moves the end effector.

    `options` are settings of the resolver. A table in it that bears a resolver's name, such as
    `[control.options.tpm]`, holds for that resolver alone; so the resolver can be swapped by
    changing its name, and nothing else. A plain setting goes before one from such a table.

    `transition` = "blend": where the order of the stack or the active control point changes, the
    command passes over from the old stack's to the new one's within `transition_time` [s]; "none":
    at once. A task that enters, such as an avoidance, has its full effect only after that time.
    """

    level: Literal["velocity", "acceleration"] = "acceleration"
    stack: Literal["switched", "hierarchical"] = "switched"
    strictness: bool = False
    period: Annotated[float, Field(gt=0.0, le=1.0)] = 0.001
    duration: Positive
    jacobian_derivative: Literal["exact", "difference"] = "exact"
    resolver: str
    options: dict[str, Any] = Field(default_factory=dict)
    policy: PolicySection = PolicySection()
    transition: Literal["none", "blend"] = "none"
    transition_time: Positive = 0.02

    @model_validator(mode="after")
    def _makes_a_resolver(self) -> Self:
        from solvers import make, names

        for name in self.options:
            if name in names() and isinstance(self.options[name], dict):
                make(name, **self.options[name])
        make(self.resolver, **self.settings())
        return self

    def settings(self) -> dict[str, Any]:
        """Settings of the resolver: those of its own table, the plain ones laid over."""
        from solvers import names

        own = self.options.get(self.resolver, {})
        plain = {key: value for key, value in self.options.items() if key not in names()}
        return {**(own if isinstance(own, dict) else {self.resolver: own}), **plain}


class PositionSection(_Section):
    """End-effector position along a path, which is moved by `offset` [m]."""

    path: PathSection
    offset: Vector3 = (0.0, 0.0, 0.0)
    stiffness: NotNegative = 40.0
    damping: NotNegative = 20.0
    gain: NotNegative = 10.0


class PointingSection(_Section):
    """The end effector's z axis in a cone of half-angle `alpha_d` [deg] about `axis`."""

    kind: Literal["equality", "inequality"] = "inequality"
    axis: Vector3
    alpha_d: Annotated[float, Field(ge=0.0, le=180.0)]
    stiffness: NotNegative = 5.0
    damping: NotNegative = 2.0
    gain: NotNegative = 5.0


class RepulsionSection(_Section):
    """Magnitude of the repulsion, eq. (23); see hierarchy.avoidance.Repulsion."""

    maximum: Positive
    reach: Positive
    shape: Positive
    scale: Positive = 2.0


class ObstacleSection(_Section):
    """An obstacle: shape, centre [m], sizes [m], rotation rows, and a path if it moves."""

    shape: Literal["point", "sphere", "capsule", "box"] = "point"
    centre: Vector3 | None = None
    radius: Positive | None = None
    half_length: Positive | None = None
    half_lengths: tuple[Positive, Positive, Positive] | None = None
    rotation: tuple[Vector3, Vector3, Vector3] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
    path: PathSection | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        needs = {"point": (), "sphere": ("radius",), "capsule": ("radius", "half_length"),
                 "box": ("half_lengths",)}[self.shape]
        for key in ("radius", "half_length", "half_lengths"):
            if (getattr(self, key) is None) == (key in needs):
                raise ValueError(f"a {self.shape} takes {' and '.join(needs) or 'no size'}")
        if (self.centre is None) == (self.path is None):
            raise ValueError("give either a centre or a path")
        return self


def _point_as_table(obstacle: Any) -> Any:
    """[x, y, z] is short for a point obstacle."""
    return {"centre": obstacle} if isinstance(obstacle, list | tuple) else obstacle


Obstacles = tuple[Annotated[ObstacleSection, BeforeValidator(_point_as_table)], ...]


class VariationSection(_Section):
    """Obstacles on slightly other paths, which follow from `seed`.

    Every waypoint is moved by up to `spread` [m] in any direction, points at which an obstacle
    rests as one; every time but the first by up to the share `timing` of half the shorter span
    beside it. Obstacles without waypoints stay as they are.
    """

    seed: Annotated[int, Field(ge=0)]
    spread: NotNegative = 0.05
    timing: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.1


class _Avoiding(_Section):
    obstacles: Obstacles
    variation: VariationSection | None = None

    @property
    def placed(self) -> Obstacles:
        """The obstacles on the paths that `variation` leads them."""
        from scenarios.variation import varied

        return self.obstacles if self.variation is None else varied(self.obstacles, self.variation)

    @model_validator(mode="after")
    def _varies_something(self) -> Self:
        if self.variation and not any(isinstance(obstacle.path, WaypointsSection)
                                      for obstacle in self.obstacles):
            raise ValueError("variation needs an obstacle with a path of waypoints")
        return self


class AvoidanceSection(_Avoiding):
    """Avoidance by the body and repulsion of the end effector, switched by Algorithm 1."""

    kind: Literal["repulsion"] = "repulsion"
    dimension: Literal[1, 3] = 1
    direction: Literal["nearest", "mean"] = "nearest"
    near: NotNegative
    far: NotNegative
    end_effector: NotNegative
    body: RepulsionSection
    tip: RepulsionSection
    jacobian: Literal["exact", "published"] = "exact"

    @model_validator(mode="after")
    def _areas_nested(self) -> Self:
        if self.near > self.far:
            raise ValueError(f"near = {self.near} m is beyond far = {self.far} m")
        return self

    @property
    def thresholds(self) -> dict[str, float]:
        """Distances of the body [m] at which something changes, by symbol."""
        outer = {r"$\epsilon_2$": self.far} if self.far > self.near else {}
        return {r"$\epsilon_1$": self.near} | outer

    @property
    def tip_thresholds(self) -> dict[str, float]:
        """The same for the end effector."""
        return {r"$\epsilon_{ee}$": self.end_effector}


class SeparationSection(_Avoiding):
    """All control points and the end effector kept off all obstacles, as one-sided rows.

    `distance` [m] that is kept; `rate` [1/s] at which it may be approached; obstacles beyond
    `influence` [m] ask for nothing; one that is too near is left at up to `recovery` [m/s], with up
    to `limit` [m/s^2]. `self_collision` is the distance [m] kept between links that are no
    neighbours, None for any. See hierarchy.avoidance.Barrier.
    """

    kind: Literal["separation"]
    distance: NotNegative = 0.03
    rate: Positive = 10.0
    influence: Positive = 0.3
    recovery: NotNegative = 0.2
    limit: Positive = 50.0
    self_collision: NotNegative | None = None
    obstacles: Obstacles = ()

    @model_validator(mode="after")
    def _areas_nested(self) -> Self:
        if self.distance >= self.influence:
            raise ValueError(f"distance = {self.distance} m is not below influence = "
                             f"{self.influence} m")
        return self

    @property
    def thresholds(self) -> dict[str, float]:
        """Distances of the body [m] at which something changes, by symbol."""
        return {r"$d_{min}$": self.distance}

    @property
    def tip_thresholds(self) -> dict[str, float]:
        """The same for the end effector."""
        return self.thresholds


def _avoidance_kind(section: Any) -> str:
    return (str(section.get("kind", "repulsion")) if isinstance(section, dict)
            else str(getattr(section, "kind", "repulsion")))


AvoidanceKind = Annotated[
    Annotated[AvoidanceSection, Tag("repulsion")] | Annotated[SeparationSection, Tag("separation")],
    Discriminator(_avoidance_kind)]


class LimitsSection(_Section):
    """The robot's joint limits, as the first level of the stack.

    With `place` = "guard" they are not in the stack: each command is moved into them joint by
    joint, whatever that does to the tasks. So they suit every resolver. "either": in the stack of a
    resolver that takes bounds, a guard for one that does not.

    Positions and velocities are those of the robot; `acceleration` [rad/s^2] of every joint, or
    one for each; `margin` [rad] is kept off the position limits; `torque` is the share of the
    effort limits that may be used, at acceleration level, or None for any torque. With
    `danger_reach` [m] joints that would move a control point toward an obstacle nearer than that
    are slowed, see hierarchy.tasks.DangerBounds.
    """

    acceleration: Positive | tuple[Positive, ...]
    place: Literal["stack", "guard", "either"] = "stack"
    margin: NotNegative = 0.0
    danger_reach: Positive | None = None
    torque: Annotated[float, Field(gt=0.0, le=1.0)] | None = None


class DampingSection(_Section):
    """Null-space term a = -D v, eq. (15): D = value I, or value M(q) with weight = "mass"."""

    value: NotNegative
    weight: Literal["identity", "mass"] = "identity"


class PostureSection(_Section):
    """Toward a posture [rad or m]: the null-space term, or with `role` = "task" the last level."""

    target: tuple[Finite, ...]
    role: Literal["null-space", "task"] = "null-space"
    stiffness: NotNegative = 10.0
    damping: NotNegative = 5.0
    gain: NotNegative = 1.0


class MeasurementSection(_Section):
    """What the controller is told of the joints, for either plant; all zero: exactly what is so.

    Normal noise of deviation `position_noise` [rad] and `velocity_noise` [rad/s], drawn from
    `seed`; steps of the position `quantisation` [rad]; `delay` [s], whole periods. velocity =
    "measured" is a sensor of its own, "differenced" the backward difference of measured positions
    behind a low-pass of `filter_time` [s].
    """

    position_noise: NotNegative = 0.0
    velocity_noise: NotNegative = 0.0
    quantisation: NotNegative = 0.0
    delay: NotNegative = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
    velocity: Literal["measured", "differenced"] = "measured"
    filter_time: NotNegative = 0.0

    @model_validator(mode="after")
    def _of_its_kind(self) -> Self:
        key = "velocity_noise" if self.velocity == "differenced" else "filter_time"
        if getattr(self, key) > 0.0:
            raise ValueError(f"velocity = {self.velocity!r} takes no {key}")
        return self

    @property
    def ideal(self) -> bool:
        """Whether nothing is changed by measuring."""
        return self.velocity == "measured" and not (
            self.position_noise or self.velocity_noise or self.quantisation or self.delay)


class ServoSection(_Section):
    """The position servo of each joint of the physics plant.

    torque = k (reference - q) + c (its rate - v) + `gravity` times what holds the arm, within the
    effort limits. k = m `bandwidth`^2 and c = 2 m `bandwidth` [rad/s], where m is the inertia that
    the joint has at the start, drive included. It runs at `rate` [Hz] (or a little faster, a whole
    number of times a period) on references interpolated linearly. `feedforward` off leaves out the
    rate of the reference. The reference leads its joint by at most `lead` [rad], so that an arm
    that is held back does not run after.
    """

    rate: Annotated[float, Field(ge=200.0, le=10000.0)] = 1000.0
    bandwidth: Positive | tuple[Positive, ...] = 80.0
    gravity: NotNegative = 1.0
    feedforward: bool = True
    lead: Positive = 0.1


class JointsSection(_Section):
    """Joints of the physics plant: one number for all, or one each. Plausible, not identified.

    friction [N m] is dry; damping [N m s/rad]; armature [kg m^2] is the inertia of motor and gear
    as felt at the joint.
    """

    friction: NotNegative | tuple[NotNegative, ...] = 0.5
    damping: NotNegative | tuple[NotNegative, ...] = 1.0
    armature: NotNegative | tuple[NotNegative, ...] = 0.3


class PlantSection(_Section):
    """What the commands move: "kinematic" follows them exactly, "mujoco" is simulated physics.

    `servo` and `joints` are those of "mujoco". It adds the commands up to a joint position
    reference. With feedback = "commanded" the controller is told that reference in place of what
    `measurement` says: it then sees neither noise nor what the joints do, as where commands through
    FRI are integrated blindly. Both are stable with the letter's gains.
    """

    kind: Literal["kinematic", "mujoco"] = "kinematic"
    feedback: Literal["measured", "commanded"] = "measured"
    measurement: MeasurementSection = MeasurementSection()
    servo: ServoSection = ServoSection()
    joints: JointsSection = JointsSection()


Share = Annotated[float, Field(ge=0.0, le=1.0)]


class SensorSection(_Section):
    """Where distances come from; settings that the kind does not use have no effect.

    "exact": known geometry. "camera": a simulated depth camera that sees obstacles and robot.
    "frames": depth images from a `folder`, or a shipped one by name, that also says which camera
    took them and when; see scenarios.sensors.frames.

    Of both kinds with images, see scenarios.sensors.depth_space: a frame is used from `latency` [s]
    after it was taken. Without a new frame for more than `stale_after` [s] the camera is blind and
    `control.policy.stale` acts; one with a reading in less than the share `least_readings` of its
    pixels is none. The robot, made of capsules with a column of height `foot` [m] below its base,
    is taken out with a `margin` [m]. Obstacles within `region` [m] of a point are seen, None for
    the largest distance at which avoidance acts. `thin` [m] is how far obstacles reach behind their
    surface, None for any distance. A pixel counts if `support` of the nine around it agree within
    `band` [m].

    Of the camera, see scenarios.sensors.camera: image size, focal lengths and centre [px], None for
    the middle; position [m]; a point [m] to look at, or a rotation, which goes before it: rows,
    whose columns are the camera's axes right, down and forward in the world. `rate` [Hz], `jitter`
    [s] of the frames; `seed` of all chance. `ideal`: without the errors, which are those of
    scenarios.sensors.errors. `backdrop` [m] is the depth of a wall, 0 for none, which may
    leave too few readings; `point_radius` [m] is that of the balls as which points are seen.
    """

    kind: Literal["exact", "camera", "frames"] = "exact"
    folder: str | None = None
    latency: NotNegative = 0.0
    stale_after: NotNegative = 0.2
    least_readings: Share = 0.1
    foot: NotNegative = 0.31
    margin: NotNegative = 0.05
    region: Positive | None = None
    thin: NotNegative | None = None
    support: Annotated[int, Field(ge=1, le=9)] = 3
    band: NotNegative = 0.05
    width: Annotated[int, Field(ge=1)] = 640
    height: Annotated[int, Field(ge=1)] = 480
    fx: Positive = 525.0
    fy: Positive = 525.0
    cx: Finite | None = None
    cy: Finite | None = None
    position: Vector3 = (0.0, 2.0, 0.7)
    look_at: Vector3 = (0.0, 0.3, 0.1)
    rotation: tuple[Vector3, Vector3, Vector3] | None = None
    rate: Positive = 30.0
    jitter: NotNegative = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
    ideal: bool = False
    noise_floor: NotNegative = 1.2e-3
    noise_growth: NotNegative = 1.9e-3
    noise_from: NotNegative = 0.4
    rounding: Literal["disparity", "step"] = "disparity"
    step: NotNegative = 2.85e-3
    near: NotNegative = 0.5
    far: Positive = 5.0
    missing: Share = 0.002
    missing_at_edges: Share = 0.3
    outliers: Share = 0.02
    outlier_size: Annotated[int, Field(ge=0)] = 2
    point_radius: NotNegative = 0.02
    backdrop: NotNegative = 4.0

    @model_validator(mode="after")
    def _complete(self) -> Self:
        if self.model_fields_set and "kind" not in self.model_fields_set:
            raise ValueError("give its kind: exact, camera or frames")
        if self.kind == "frames" and self.folder is None:
            raise ValueError('kind = "frames" needs a folder')
        return self


class FaultSection(_Section):
    """Something that goes wrong on purpose from `at` [s] on, for `duration` [s].

    nan_position, nan_velocity: what is measured of `joint` (1, 2, ...; of all without it) is NaN.
    nan_distance: so is the distance of `point` (control points 1, 2, ..., then the end effector;
    of all without it). stale: joints and distances stay as they were. status: the resolver says
    `status` of its answer. overrun: the tick takes `takes` [s] more. obstacle: a sphere of `radius`
    [m] stands at `centre` [m], or at `place` on the body as this was when the sphere appeared.
    no_frames: the camera takes no images; dark_frames: they have no readings.
    """

    kind: Literal["nan_position", "nan_velocity", "nan_distance", "stale", "status", "overrun",
                  "obstacle", "no_frames", "dark_frames"]
    at: NotNegative
    duration: Positive
    joint: Annotated[int, Field(ge=1)] | None = None
    point: Annotated[int, Field(ge=1)] | None = None
    status: Literal["iteration_limit", "numerical_failure", "backend_failure",
                    "inaccurate"] | None = None
    takes: Positive | None = None
    centre: Vector3 | None = None
    place: ControlPointSection | None = None
    radius: Positive | None = None

    @model_validator(mode="after")
    def _complete(self) -> Self:
        of_kind = {"nan_position": {"joint"}, "nan_velocity": {"joint"}, "nan_distance": {"point"},
                   "status": {"status"}, "overrun": {"takes"},
                   "obstacle": {"centre", "place", "radius"}}.get(self.kind, set())
        for key in ("joint", "point", "status", "takes", "centre", "place", "radius"):
            if getattr(self, key) is not None and key not in of_kind:
                raise ValueError(f"a fault of kind {self.kind!r} takes no {key}")
        for key in of_kind & {"status", "takes", "radius"}:
            if getattr(self, key) is None:
                raise ValueError(f"a fault of kind {self.kind!r} needs {key}")
        if self.kind == "obstacle" and (self.centre is None) == (self.place is None):
            raise ValueError("give either a centre or a place")
        return self


class Scenario(_Section):
    """One scenario: a robot, a start, tasks, and how they are resolved.

    Sections of tasks that are absent ask for nothing. `tasks` are further ones, in order of
    priority behind limits, avoidance, position and pointing. `damping` and `posture` are the
    null-space term of eq. (14), so only one of them may be given.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_.-]*$")]
    title: str = ""
    description: str = ""
    robot: RobotSection
    start: StartSection = StartSection()
    control: ControlSection
    plant: PlantSection = PlantSection()
    sensor: SensorSection = SensorSection()
    position: PositionSection | None = None
    pointing: PointingSection | None = None
    avoidance: AvoidanceKind | None = None
    limits: LimitsSection | None = None
    damping: DampingSection | None = None
    posture: PostureSection | None = None
    tasks: tuple[ListedTask, ...] = ()
    faults: tuple[FaultSection, ...] = ()

    @model_validator(mode="after")
    def _asks_for_something(self) -> Self:
        if not (self.position or self.pointing or self.avoidance or self.tasks):
            raise ValueError("the stack is empty: give at least one of [position], [pointing], "
                             "[avoidance], [[tasks]]")
        if self.damping and self.posture and self.posture.role == "null-space":
            raise ValueError("give [damping] or [posture], not both: each is the null-space term")
        if self.posture and self.posture.role == "task" and self.control.stack == "switched":
            raise ValueError('posture.role = "task" goes with control.stack = "hierarchical"')
        if self.control.strictness and not self.position:
            raise ValueError("control.strictness needs [position]")
        switched = self.control.stack == "switched"
        if self.avoidance and switched != (self.avoidance.kind == "repulsion"):
            raise ValueError('avoidance.kind = "repulsion" goes with control.stack = "switched", '
                             '"separation" with "hierarchical"')
        if self.avoidance and switched and not self.position:
            raise ValueError("[avoidance] needs [position]: Algorithm 1 orders one by the other")
        if self.limits and self.limits.danger_reach and not self.avoidance:
            raise ValueError("limits.danger_reach needs [avoidance], whose obstacles it sees")
        if self.limits and self.limits.place != "stack" and (
                self.limits.torque or self.limits.danger_reach):
            raise ValueError('limits.torque and limits.danger_reach need limits.place = "stack"')
        if self.limits and self.limits.torque and self.control.level == "velocity":
            raise ValueError("limits.torque needs control.level = \"acceleration\"")
        return self

    @model_validator(mode="after")
    def _lists_tasks_apart(self) -> Self:
        if self.tasks and self.control.stack == "switched":
            raise ValueError('[[tasks]] goes with control.stack = "hierarchical"')
        names = [task.title for task in self.tasks]
        names += [name for name in ("position", "pointing", "posture") if getattr(self, name)]
        for name, count in Counter(names).items():
            if count > 1:
                raise ValueError(f"{count} tasks are called {name!r}; give each a name of its own")
        return self

    @model_validator(mode="after")
    def _faults_have_a_sensor(self) -> Self:
        blind = next((fault.kind for fault in self.faults
                      if fault.kind in ("nan_distance", "obstacle")), None)
        if blind and not self.avoidance:
            raise ValueError(f"a fault of kind {blind!r} needs [avoidance]")
        kinds, sensor = {fault.kind for fault in self.faults}, self.sensor.kind
        if sensor != "exact" and not self.avoidance:
            raise ValueError(f"sensor.kind = {sensor!r} needs [avoidance], which it serves")
        if sensor == "exact" and kinds & {"no_frames", "dark_frames"}:
            raise ValueError("faults of frames need a sensor of kind \"camera\" or \"frames\"")
        if sensor == "frames" and "obstacle" in kinds:
            raise ValueError("a fault of kind 'obstacle' would not be in the recorded frames")
        return self

    @property
    def is_experiment(self) -> bool:
        """Whether it stands for the letter's section IV-B: physics, or distances seen."""
        return self.plant.kind != "kinematic" or self.sensor.kind != "exact"

    @property
    def limits_in_stack(self) -> bool:
        """Whether the joint limits are a level of the stack, under the resolver that it names."""
        if self.limits is None or self.limits.place == "guard":
            return False
        return self.limits.place == "stack" or self.make_resolver().handles != "equalities"

    @property
    def asks(self) -> Handles:
        """Which kind of rows its stack has, under the resolver that it names."""
        inequalities = self.control.stack == "hierarchical" and (
            self.avoidance is not None or (self.pointing and self.pointing.kind == "inequality")
            or any(isinstance(task, ListedPointing) and task.rows == "inequality"
                   for task in self.tasks))
        limits = self.limits if self.limits_in_stack else None
        if inequalities or (limits and limits.torque):
            return "inequalities"
        return "bounds" if limits else "equalities"

    def make_resolver(self) -> Resolver:
        """Make the resolver that `control.resolver` and `control.options` describe."""
        from solvers import make

        return make(self.control.resolver, **self.control.settings())

    def with_resolver(self, spec: str) -> Scenario:
        """Return this scenario under another resolver.

        `spec` is `name` or `name:setting=value:setting=value`. The scenario's settings are kept
        where the named resolver has them; those of the spec go before them.
        """
        from solvers import make

        name, *settings = spec.split(":")
        own = {field.name for field in dataclasses.fields(make(name))}
        kept = {key: value for key, value in self.control.options.items()
                if key in own or isinstance(value, dict)}
        options = {**kept, **_parse_changes(settings, what=f"resolver {spec!r}")}
        control = {**self.control.model_dump(), "resolver": name, "options": options}
        return _validated({**self.model_dump(), "control": control}, f"resolver {spec!r}")

    def with_changes(self, changes: Mapping[str, Any]) -> Scenario:
        """Return this scenario with other values of dotted keys; ScenarioError as `load` does."""
        data = self.model_dump()
        for key, value in changes.items():
            _change(data, key, value)
        return _validated(data, f"scenario {self.name!r}")

    def to_toml(self) -> str:
        """Return the scenario as a file that `load` reads back."""
        return tomli_w.dumps(_without_none(self.model_dump(mode="json")))


def shipped() -> tuple[str, ...]:
    """Names of the scenarios that come with the package."""
    return tuple(sorted(path.stem for path in LIBRARY.glob("*.toml")))


def load(name_or_path: str | Path, changes: Sequence[str] | Mapping[str, Any] = ()) -> Scenario:
    """Read a shipped scenario by name, or a scenario file by path, and apply changes to it.

    A file may begin with `extends = "ellipse"` (a shipped name or a path beside it) and then gives
    only what differs. `changes` are "dotted.key=value" texts with TOML values, or a mapping of
    dotted keys. Raises ScenarioError, naming the file and the key, and UnknownNameError for a name
    that is not shipped.
    """
    path = Path(name_or_path)
    if path.suffix != ".toml":
        if str(name_or_path) not in shipped():
            raise UnknownNameError("scenario", str(name_or_path), shipped())
        path = LIBRARY / f"{name_or_path}.toml"
    data = _read_extended(path)
    if not isinstance(changes, Mapping):
        changes = _parse_changes(changes, what="--set")
    for key, value in changes.items():
        _change(data, key, value)
    robot = data.get("robot")
    if isinstance(robot, dict) and not in_package(model := str(robot.get("model", ""))) and (
            model.endswith((".urdf", ".xml", ".mjcf"))):
        robot["model"] = str(path.parent.resolve() / robot["model"])
    sensor = data.get("sensor")
    folder = sensor.get("folder") if isinstance(sensor, dict) else None
    if isinstance(folder, str) and not (LIBRARY / "frames" / folder).is_dir():
        data["sensor"]["folder"] = str(path.parent.resolve() / folder)
    return _validated(data, str(path) if path.parent != LIBRARY else f"scenario {path.stem!r}")


def changed(data: dict[str, Any], changes: Sequence[str]) -> dict[str, Any]:
    """Apply "dotted.key=value" texts to `data`, which is changed, and return it."""
    for key, value in _parse_changes(changes, what="--set").items():
        _change(data, key, value)
    return data


def _read_extended(path: Path, below: tuple[Path, ...] = ()) -> dict[str, Any]:
    """Read a file and, under it, the shipped scenario or the file that its `extends` names."""
    data = _read(path)
    base = data.pop("extends", None)
    if base is None:
        return data
    if not isinstance(base, str):
        raise ScenarioError(f"{path}: extends: expected a name or a path, got {base!r}")
    source = LIBRARY / f"{base}.toml" if base in shipped() else path.parent / base
    if source.resolve() in (*below, path.resolve()):
        raise ScenarioError(f"{path}: extends: {base!r} extends this file in turn")
    if source.suffix != ".toml":
        raise ScenarioError(f"{path}: extends: {UnknownNameError('scenario', base, shipped())}")
    return _laid_over(_read_extended(source, (*below, path.resolve())), data)


def _laid_over(below: dict[str, Any], above: dict[str, Any]) -> dict[str, Any]:
    merged = dict(below)
    for key, value in above.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _laid_over(merged[key], value) if both else value
    return merged


def _read(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise ScenarioError(f"scenario file {str(path)!r} does not exist") from error
    except OSError as error:
        raise ScenarioError(f"scenario file {str(path)!r}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise ScenarioError(f"scenario file {str(path)!r} is not UTF-8 text") from error
    except tomllib.TOMLDecodeError as error:  # its text says line and column
        raise ScenarioError(f"scenario file {str(path)!r}: {error}") from error


def _parse_changes(changes: Sequence[str], what: str) -> dict[str, Any]:
    parsed = {}
    for change in changes:
        key, equals, text = change.partition("=")
        if not equals or not key.strip():
            raise ScenarioError(f"{what}: expected key=value, got {change!r}")
        parsed[key.strip()] = _value(text.strip(), f"{what} {change!r}")
    return parsed


def _value(text: str, what: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError as error:
        if text and all(c.isalnum() or c in "_-./" for c in text):
            return text  # a bare word: quotes are a nuisance on a command line
        raise ScenarioError(f"{what}: {text!r} is not a TOML value") from error


def _change(data: dict[str, Any], dotted: str, value: Any) -> None:
    *path, last = dotted.split(".")
    table = data
    for key in path:
        table = table.setdefault(key, {})
        if not isinstance(table, dict):
            raise ScenarioError(f"{dotted}: {key!r} is not a table")
    table[last] = value


def _validated(data: dict[str, Any], what: str) -> Scenario:
    try:
        return Scenario.model_validate(data)
    except ValidationError as error:
        raise ScenarioError("\n".join(_say(what, e) for e in error.errors())) from error
    except HierarchyError as error:  # what a resolver says of its settings
        raise ScenarioError(f"{what}: control: {error}") from error


def _say(what: str, error: Any) -> str:
    keys = _without_kinds([str(key) for key in error["loc"]])
    where = ".".join(keys) or "file"
    if error["type"] == "extra_forbidden":
        return f"{what}: {UnknownNameError('key', where, _keys_beside(keys))}"
    text = error["msg"].removeprefix("Value error, ")
    value = "" if isinstance(error["input"], dict) else f", got {error['input']!r}"
    return f"{what}: {where}: {text}{value}"


def _without_kinds(loc: list[str]) -> list[str]:
    """Leave out what pydantic puts into a place for the kind that was chosen there."""
    return [key for i, key in enumerate(loc)
            if i in (0, len(loc) - 1) or key not in _kinds_at(loc[:i])]


def _keys_beside(keys: list[str]) -> list[str]:
    """Full names of the keys that may stand where the last of `keys` stands."""
    beside = _sections_at(keys[:-1])
    known = dict.fromkeys(key for section in beside for key in section.model_fields)
    return [".".join([*keys[:-1], key]) for key in known]


def _kinds_at(path: list[str]) -> set[str]:
    found = (section.model_fields.get("kind") for section in _sections_at(path))
    return {kind for field in found if field for kind in getattr(field.annotation, "__args__", ())}


def _sections_at(path: list[str]) -> list[Any]:
    """The sections that may stand at a path: more than one where a kind decides."""
    sections: list[Any] = [Scenario]
    for key in (key for key in path if not key.isdigit()):  # a place in a list is no key
        fields = [section.model_fields[key] for section in sections if key in section.model_fields]
        sections = [found for field in fields for found in _sections_in(field.annotation)]
    return sections


def _sections_in(annotation: Any) -> list[Any]:
    if isinstance(annotation, type) and issubclass(annotation, _Section):
        return [annotation]
    return [found for part in getattr(annotation, "__args__", ()) for found in _sections_in(part)]


def _without_none(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _without_none(value) for key, value in data.items() if value is not None}
    if isinstance(data, list):
        return [_without_none(value) for value in data]
    return data
