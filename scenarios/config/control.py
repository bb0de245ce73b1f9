"""The keys of [control], and of [[faults]], which are injected into it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field

from scenarios.config.robot import ControlPointSection
from scenarios.config.sections import (
    Count,
    Flag,
    Length,
    NotNegative,
    Point,
    Section,
    Span,
    Time,
    Unit,
)

AnswerPolicy = Literal["brake", "hold", "stop", "use"]
BlindPolicy = Literal["brake", "hold", "stop"]
MOST_TICKS = 10_000_000  # some kB each in memory
StackKind = Literal["switched", "hierarchical", "set-based", "smooth"]


class PolicySection(Section):
    """The command sent in a tick with a problem, for each kind of problem.

    "brake": decelerate to rest. "hold": repeat the last good command for at most `patience`
    consecutive ticks, then brake. "stop": decelerate as fast as the limits allow and end the run
    with a fault. "use": send the answer, if there is one. If a tick has several problems, the most
    cautious action wins, in the order use, hold, brake, stop. At level "torque" braking sends the
    last good torques and a damping, the effort limit of a joint at its velocity limit; "stop" ends
    the run at once. The first four kinds are statuses of a resolver, see solvers.Status.
    """

    iteration_limit: AnswerPolicy = "brake"
    """The resolver reached its largest number of iterations."""
    numerical_failure: BlindPolicy = "brake"
    """The resolver has no usable answer."""
    backend_failure: AnswerPolicy = "brake"
    """The solver behind the resolver failed."""
    inaccurate: AnswerPolicy = "brake"
    """The answer does not reach the resolver's accuracy."""
    not_finite: BlindPolicy = "brake"
    """A measured joint state is not finite or has an invalid quaternion, or a distance is NaN."""
    stale: BlindPolicy = "brake"
    """No new measurement for more than `stale_after`; before that, the last one is extrapolated
    from the commands sent."""
    overrun: AnswerPolicy = "brake"
    """The command is not ready at the `deadline`."""
    inside: AnswerPolicy = "brake"
    """A point of the robot is on or inside an obstacle."""
    patience: Count = 10
    """Ticks for which "hold" repeats a command."""
    stale_after: Time = 0.02
    """Age from which a measurement is stale."""
    deadline: Span | None = None
    """Time from the start of a tick until its command must be ready; without it there is no
    deadline."""


class ControlSection(Section):
    """How the tasks are resolved, and how often."""

    level: Literal["velocity", "acceleration", "torque"] = "acceleration"
    """What the command is. "torque": accelerations and contact forces are resolved together, and
    the command is the joint torques that they take. The stack has the dynamics and [[contacts]]
    first, then torque limits and [forces], then the joint limits."""
    stack: StackKind = "switched"
    """"switched": Algorithm 1 selects the tasks in the stack, all as equalities. With
    avoidance.kind = "separation" only the cone is left to select: limits and avoidance are first.
    "hierarchical": limits, avoidance, position and pointing are always in it, in this order, and
    inequalities stay inequalities. "set-based" and "smooth", at velocity level only, have the same
    tasks in the same order: inequalities are frozen at their bounds, see
    solvers.resolvers.set_based, or act gradually within a `buffer`, see solvers.resolvers.smooth,
    which needs `resolver` = "smooth"."""
    strictness: Flag = False
    """Whether every tick is also resolved without the levels below the position, to measure
    whether they move the end effector; this is not part of the measured times."""
    period: Annotated[float, Field(strict=True, gt=0.0, le=1.0), Unit("s")] = 0.001
    """Time from tick to tick."""
    duration: Span
    """How long a run lasts."""
    jacobian_derivative: Literal["exact", "difference"] = "exact"
    """How dJ/dt is found: "exact", or by the "difference" of two ticks."""
    resolver: str
    """Name of a resolver, see `hierarchy list`, or of a plug-in."""
    options: dict[str, Any] = Field(default_factory=dict)
    """Settings of the resolver. A table in it with a resolver's name, such as
    `[control.options.tpm]`, applies to that resolver only, so that changing `resolver` is enough to
    swap it. Plain settings override those from such a table."""
    damping: NotNegative = 1.0
    """Damping, at velocity level, of tasks that cannot be met: near singularities and out of
    reach, where they come to rest. 0 for none. The damping of a resolver is in `options`."""
    metric: Literal["identity", "mass"] = "identity"
    """Measure of the distance to the null-space term: "identity", the sum of squares over the
    joints; or "mass", the inertia M(q), at acceleration level that of operational-space control."""
    policy: PolicySection = PolicySection()
    """The command in a tick with a problem."""
    transition: Literal["none", "blend"] = "none"
    """"blend": when the order of the stack or the active control point changes, the command moves
    to that of the new stack within `transition_time`. "none": it changes at once."""
    transition_time: Span = 0.02
    """How long "blend" takes."""

    def _wrong(self) -> Iterator[str]:
        from solvers import make, names, variants

        for name in {*names(), *variants()} & self.options.keys():
            table = self.options[name]
            make(name, **(table if isinstance(table, dict) else {name: table}))
        make(self.resolver, **self.settings())
        if self.ticks > MOST_TICKS:
            yield (f"duration = {self.duration:g} s at period = {self.period:g} s is "
                   f"{self.duration / self.period:.3g} ticks; a recording keeps at most "
                   f"{MOST_TICKS:,}")

    @property
    def ticks(self) -> int:
        """Number of ticks of a run, at least one."""
        return max(1, round(min(self.duration / self.period, 1e18)))

    def settings(self) -> dict[str, Any]:
        """Return the resolver's settings: those of its table, overridden by plain ones."""
        from solvers import names, variants

        own = self.options.get(self.resolver, {})
        tables = (*names(), *variants())
        plain = {key: value for key, value in self.options.items() if key not in tables}
        return {**(own if isinstance(own, dict) else {self.resolver: own}), **plain}


class FaultSection(Section):
    """An injected fault."""

    kind: Literal["nan_position", "nan_velocity", "nan_distance", "stale", "status", "overrun",
                  "obstacle", "no_frames", "dark_frames"]
    """"nan_position", "nan_velocity": the measurement of `joint` is NaN. "nan_distance": the
    distance of `point` is NaN. "stale": measured joints and distances are frozen. "status": the
    resolver reports `status`. "overrun": the tick takes longer. "obstacle": a sphere appears.
    "no_frames": the camera takes no images. "dark_frames": its images have no readings."""
    at: Time
    """When it begins."""
    duration: Span
    """How long it lasts."""
    joint: Annotated[int, Field(strict=True, ge=1)] | None = None
    """Number of a joint from 1; by default all."""
    point: Annotated[int, Field(strict=True, ge=1)] | None = None
    """Number of a control point from 1, then of the end effector; by default all."""
    status: Literal["iteration_limit", "numerical_failure", "backend_failure",
                    "inaccurate"] | None = None
    """What the resolver reports."""
    takes: Span | None = None
    """Time that a tick takes longer."""
    centre: Point | None = None
    """Middle of the sphere."""
    place: ControlPointSection | None = None
    """Point of the body, in place of `centre`, where the sphere appears at that time."""
    radius: Length | None = None
    """Radius of the sphere."""

    def _wrong(self) -> Iterator[str]:
        of_kind = {"nan_position": {"joint"}, "nan_velocity": {"joint"}, "nan_distance": {"point"},
                   "status": {"status"}, "overrun": {"takes"},
                   "obstacle": {"centre", "place", "radius"}}.get(self.kind, set())
        for key in ("joint", "point", "status", "takes", "centre", "place", "radius"):
            if getattr(self, key) is not None and key not in of_kind:
                yield f"a fault of kind {self.kind!r} takes no {key}"
        for key in of_kind & {"status", "takes", "radius"}:
            if getattr(self, key) is None:
                yield f"a fault of kind {self.kind!r} needs {key}"
        if self.kind == "obstacle" and (self.centre is None) == (self.place is None):
            yield "give either a centre or a place"
