"""The keys of [control], what goes with each kind of its stack, and the keys of [[faults]]."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from scenarios.config import sections as keys
from scenarios.config.sections.avoidance import AvoidanceKind, BarrierSection, SeparationSection
from scenarios.config.sections.robot import PointSection
from scenarios.config.sections.tasks import LimitsSection, Made, PointingTask

AnswerPolicy = Literal["brake", "hold", "stop", "use"]
BlindPolicy = Literal["brake", "hold", "stop"]
MOST_TICKS = 10_000_000  # some kB each in memory
StackKind = Literal["switched", "hierarchical", "set-based", "smooth"]
RIVALS = ("set-based", "smooth")  # kinds of `control.stack` that are defined at velocity level
_PUSHES = ("rate", "influence", "recovery", "limit", "gain")  # keys of how fast a row is left


class PolicySection(keys.Section):
    """The command in a tick with a problem.

    "use": send the answer, if any. "hold": repeat the last good command for at most `patience`
    ticks, then brake. "brake": decelerate to rest. "stop": brake as fast as the limits allow and
    end the run with a fault. The last in this order wins. At level "torque" braking sends the
    torques that slow all joints down at 10 / s under the last good contact forces; "stop" ends the
    run at once.
    """

    iteration_limit: AnswerPolicy = "brake"  #: Status of the resolver: too many iterations.
    numerical_failure: BlindPolicy = "brake"  #: Status: no usable answer.
    backend_failure: AnswerPolicy = "brake"  #: Status: the solver behind the resolver failed.
    inaccurate: AnswerPolicy = "brake"  #: Status: an answer below the resolver's accuracy.
    not_finite: BlindPolicy = "brake"
    """A measured state is not finite, its quaternion invalid, or a distance NaN."""
    stale: BlindPolicy = "brake"
    """No measurement for more than `stale_after`; until then the last one is extrapolated from the
    commands."""
    overrun: AnswerPolicy = "brake"  #: The command is not ready at the `deadline`.
    inside: AnswerPolicy = "brake"  #: A point of the robot is in an obstacle.
    patience: keys.Count = 10  #: Ticks for which "hold" repeats a command.
    stale_after: keys.Time = 0.02  #: Age from which a measurement is stale.
    deadline: keys.Span | None = None
    """Time in a tick until its command must be ready, by default unlimited."""


class ControlSection(keys.Section):
    """How the tasks are resolved, and how often."""

    level: Literal["velocity", "acceleration", "torque"] = "acceleration"
    """What the command is. "torque": accelerations and contact forces are resolved together, and
    the command is the torques they take; dynamics and [[contacts]] come first, then torque limits
    and [forces], then joint limits."""
    stack: StackKind = "switched"
    """"switched": Algorithm 1 selects tasks, all as equalities; with avoidance.kind = "separation"
    only the cone, below limits and avoidance. "hierarchical": limits, avoidance, position and
    pointing, always and in this order, with inequalities. "set-based", "smooth": the same order at
    velocity level; inequalities are frozen at their bounds, or act gradually within a `buffer`,
    which needs `resolver` = "smooth"."""
    strictness: keys.Flag = False
    """Whether to measure, untimed, how far the levels below the position move the end effector."""
    period: Annotated[float, Field(strict=True, gt=0.0, le=1.0), keys.Unit("s")] = 0.001
    """Time from tick to tick."""
    duration: keys.Span  #: How long a run lasts.
    jacobian_derivative: Literal["exact", "difference"] = "exact"
    """dJ/dt: "exact", or the "difference" of two ticks."""
    resolver: str  #: One of `hierarchy list`, of a plug-in, or "smooth".
    options: dict[str, Any] = Field(default_factory=dict)
    """Settings of the resolver. A table with a resolver's name, such as `[control.options.tpm]`, is
    for that resolver only; plain settings override it."""
    damping: keys.NotNegative = 1.0
    """Damping, at velocity level, of tasks that cannot be met, near singularities and out of reach.
    A resolver's damping is in `options`."""
    metric: Literal["identity", "mass"] = "identity"
    """Metric of the distance to the null-space term: "identity", or "mass", the inertia M(q)."""
    policy: PolicySection = PolicySection()  #: The command in a tick with a problem.
    transition: Literal["none", "blend"] = "none"
    """After a change of the stack's order or the active control point the command changes at once
    ("none") or within `transition_time` ("blend")."""
    transition_time: keys.Span = 0.02  #: How long "blend" takes.

    def _wrong(self) -> Iterator[str]:
        from solvers import make, names, variants

        for name in {*names(), *variants()} & self.options.keys():
            table = self.options[name]
            make(name, **(table if isinstance(table, dict) else {name: table}))
        make(self.resolver, **self.settings())
        fields = type(self).model_fields
        if self.level != "velocity" and self.damping not in (0.0, fields["damping"].default):
            yield (f'damping = {self.damping:g} goes with level = "velocity", got "{self.level}"; '
                   "that of a resolver is options.damping")
        if self.transition == "none" and self.transition_time != fields["transition_time"].default:
            yield f'transition_time = {self.transition_time:g} s goes with transition = "blend"'
        if self.ticks > MOST_TICKS:
            yield (f"duration = {self.duration:g} s at period = {self.period:g} s is "
                   f"{self.duration / self.period:.3g} ticks; a recording keeps at most "
                   f"{MOST_TICKS:,}")

    @property
    def ticks(self) -> int:
        """Number of ticks of a run, at least one."""
        return max(1, round(min(self.duration / self.period, 1e18)))

    @property
    def lasts(self) -> float:
        """How long those ticks last [s], which need not be the duration."""
        return self.ticks * self.period

    def settings(self) -> dict[str, Any]:
        """Return the resolver's settings: those of its table, overridden by plain ones."""
        from solvers import names, variants

        own = self.options.get(self.resolver, {})
        tables = (*names(), *variants())
        plain = {key: value for key, value in self.options.items() if key not in tables}
        return {**(own if isinstance(own, dict) else {self.resolver: own}), **plain}


def unfit(control: ControlSection, limits: LimitsSection | None,
          avoidance: AvoidanceKind | None, tasks: Mapping[str, Made]) -> Iterator[str]:
    """Yield what a scenario asks for that its kind of stack does not have.

    `tasks` has the sections of tasks by their dotted keys.
    """
    apart: dict[str, Any] = {"avoidance": avoidance} if isinstance(
        avoidance, SeparationSection) else {}
    pointing = {key: task for key, task in tasks.items() if isinstance(task, PointingTask)}
    if control.transition != "none" and control.stack != "switched":
        yield (f'control.transition = "{control.transition}" goes with control.stack = "switched", '
               f'got "{control.stack}"')
    if control.stack in RIVALS:
        yield from _unfit_control(control, limits)
    if control.stack == "smooth":
        yield from _unfit_buffers(pointing, apart | {
            key: task for key, task in tasks.items() if isinstance(task, BarrierSection)})
        return
    if control.stack == "set-based":
        yield from _unused(tasks, apart)
    for key, one in {**pointing, **apart}.items():
        if one.buffer is not None:
            yield (f'{key}.buffer = {one.buffer:g} goes with control.stack = "smooth", got '
                   f'"{control.stack}"')


def _unfit_control(control: ControlSection, limits: LimitsSection | None) -> Iterator[str]:
    kind = f'control.stack = "{control.stack}"'
    if control.level != "velocity":
        yield (f'{kind} needs control.level = "velocity", got "{control.level}": the method '
               "commands rates that may change at once, which accelerations cannot")
    if limits and limits.place in ("stack", "bounds"):
        yield f'{kind} needs limits.place = "guard", got "{limits.place}"'
    if control.damping not in (0.0, ControlSection.model_fields["damping"].default):
        yield f"control.damping = {control.damping:g} does not go with {kind}"
    if control.strictness:
        yield f"control.strictness = true does not go with {kind}"


def _unused(tasks: Mapping[str, Made], apart: Mapping[str, Any]) -> Iterator[str]:
    """Yield the keys of pushing back that are set: a set-based task is frozen; or what gives."""
    for where, task in tasks.items():
        if give := getattr(task, "give", 0.0):
            yield (f'{where}.give = {give:g} does not go with control.stack = "set-based": a row '
                   "that gives has two sides")
    frozen = {key: task for key, task in tasks.items() if task.one_sided}
    for where, one in {**apart, **frozen}.items():
        for key in _PUSHES:
            field = type(one).model_fields.get(key)
            if field is not None and (value := getattr(one, key)) != field.default:
                yield (f'{where}.{key} = {value:g} does not go with control.stack = "set-based": a '
                       "task is frozen, not pushed")


def _unfit_buffers(pointing: Mapping[str, PointingTask],
                   apart: Mapping[str, BarrierSection]) -> Iterator[str]:
    """Yield the buffers that are missing, not used, or too wide; `apart` are in [avoidance]'s."""
    lacks = 'control.stack = "smooth" needs {}.buffer, in which an inequality comes into effect'
    for where, task in pointing.items():
        if task.rows == "equality" and task.buffer is not None:
            yield f'{where}.buffer = {task.buffer:g} does not go with {where}.kind = "equality"'
        if task.rows == "inequality" and task.buffer is None:
            yield lacks.format(where)
        if task.rows == "inequality" and (task.buffer or 0.0) > task.alpha_d:
            yield (f"{where}.buffer = {task.buffer:g} deg is wider than {where}.alpha_d = "
                   f"{task.alpha_d:g} deg")
    buffer = getattr(apart.get("avoidance"), "buffer", None)
    for where, one in apart.items():
        widest = max(one.distance, getattr(one, "self_collision", None) or 0.0)
        if buffer is None:
            yield lacks.format("avoidance")
        elif widest + buffer >= one.influence:
            yield (f"avoidance.buffer = {buffer:g} m reaches from {widest:g} m beyond "
                   f"{where}.influence = {one.influence:g} m")


class FaultSection(keys.Section):
    """An injected fault."""

    kind: Literal["nan_position", "nan_velocity", "nan_distance", "stale", "status", "overrun",
                  "obstacle", "no_frames", "dark_frames"]
    """"nan_position", "nan_velocity": `joint` is measured as NaN. "nan_distance": `point` is.
    "stale": measurements are frozen. "status": the resolver reports `status`. "overrun": a tick
    takes longer. "obstacle": a sphere appears. "no_frames": the camera stops. "dark_frames": images
    have no readings."""
    at: keys.Time  #: When it begins.
    duration: keys.Span  #: How long it lasts.
    joint: keys.Number | None = None  #: Number of a joint from 1; by default all.
    point: keys.Number | None = None
    """Number of a control point from 1, last the end effector; by default all."""
    status: Literal["iteration_limit", "numerical_failure", "backend_failure",
                    "inaccurate"] | None = None  #: What the resolver reports.
    takes: keys.Span | None = None  #: Time that a tick takes longer.
    centre: keys.Point | None = None  #: Middle of the sphere.
    place: PointSection | None = None  #: Point of the robot, in place of `centre`.
    radius: keys.Length | None = None  #: Radius of the sphere.

    def acts(self, t: Any, period: float) -> Any:
        """Whether it acts in the tick or ticks (...) at t [s]: it begins in the nearest one."""
        passed = t - self.at + period / 2
        return (passed >= 0.0) & (passed < self.duration)

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
