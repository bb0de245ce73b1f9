"""The keys of [control]."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from scenarios.config.sections import NotNegative, Positive, Section

AnswerPolicy = Literal["brake", "hold", "stop", "use"]
BlindPolicy = Literal["brake", "hold", "stop"]


class PolicySection(Section):
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


class ControlSection(Section):
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
