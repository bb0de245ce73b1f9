"""A plugin: kinds of every group, many of which are wrong. See tests/data/seen/plugins.txt."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from mechanisms import four_bar

from hierarchy import Robot, Task
from hierarchy.paths import Path
from hierarchy.plugins import register
from hierarchy.robot import Frame
from hierarchy.tasks import JointCoupling, Position
from scenarios.cell.plants import KinematicArm
from scenarios.draw.figures.panels import Panel
from scenarios.measure.metrics import Metric  # noqa: F401 (of descriptions)
from scenarios.recording.signals import Signal
from solvers import Resolution, Resolver, make


@register("tasks", "elbow")
def elbow(robot: Robot, joint: str, angle: float, gain: float = 2.0, name: str = "elbow"):
    return JointCoupling(robot, {joint: 1.0}, angle, gain=gain, name=name)


@register("tasks", "along")
def along(frame: Frame, path: Path, name: str):
    return Position(frame, path, name=name)


@register("tasks", "shown")
def shown(frame: Frame | None = None, frames: list[Frame] = (), path: Path | None = None,
          number: float | None = None, numbers: dict[str, float] = None):  # noqa: RUF013
    raise ValueError(repr((frame, frames, path, number, numbers)))


@register("resolvers", "halved")
@dataclass(frozen=True, kw_only=True)
class Halved(Resolver):
    name: ClassVar[str] = "halved"
    handles: ClassVar[str] = "inequalities"
    share: float = 0.5

    def solve(self, h, memory=None):
        return Resolution(self.share * make("hcod").solve(h).x)


@register("robots", "my_arm")
def my_arm():
    return Robot.named("kuka_lwr")


@register("plants", "weak")
class Weak(KinematicArm):
    def __init__(self, robot, q, v, period, level, share: float):
        super().__init__(robot, q, v, period, level)
        self.share = share

    def act(self, command):
        super().act(self.share * command)


@register("tasks", "brittle")
@dataclass(frozen=True)
class Brittle(Task):
    since: float
    fault: str = "1 / 0"
    name: str = "brittle"
    gain = 2.0
    dimension = 1
    unit, kind = "kg", "inequality"

    def error(self, state):
        return np.array([eval(self.fault) if state.t >= self.since else 1.0 - state.q[3]])

    def jacobian(self, state):
        return np.eye(7)[3:4]

    def jacobian_derivative(self, state):
        return np.zeros((1, 7))


@register("plants", "odd")
class Odd(KinematicArm):
    """Does something as it is made, and then in each tick but the first ten."""

    def __init__(self, robot, q, v, period, level, made: str = "", then: str = ""):
        super().__init__(robot, q, v, period, level)
        self.then, self.ticks = then, 0
        exec(made)

    def act(self, command):
        super().act(command)
        self.ticks += 1
        if self.ticks > 10:
            exec(self.then)


X = np.zeros(7)


@register("resolvers", "kept")
class Kept(Resolver):
    name, handles = "kept", "inequalities"

    def solve(self, h, memory=None):
        X[:] = make("hcod").solve(h).x
        return Resolution(X)


@register("metrics", "own")
def own(recording, by):
    """Metrics that the description of the scenario makes."""
    yield from eval(recording.scenario.description or "()")


register("plants", "none")(lambda: None)
register("robots", "same")(Robot.named("kuka_lwr"))
register("robots", "four_bar")(four_bar)
register("robots", "odd")(lambda: 1 / 0)
register("figures", "odd")(Panel("odd", "Odd", "rad", "q", lambda *_: exit(3)))
register("figures", "first-joint")(Panel(
    "first-joint", "First", "rad", "q",
    lambda ax, run, colour: ax.plot(run["t"], run["q"][:, 0], color=colour)))
register("sensors", "odd")(lambda exact: exact.measurement)
register("signals", "strain")(Signal("strain", "Pa", "(T,)", "of a link", "/links"))
register("signals", "file")(Signal("odd", "Pa", "(T,)", ""))
register("tasks", "odd")(type("OddTask", (JointCoupling,), {"dimension": 1.5}))
for name, kind in (
        ("function", len), ("number", int),
        ("failing", type("Failing", (Halved,), {"__post_init__": lambda self: 1 / 0})),
        ("unsure", type("Unsure", (Halved,), {"accuracy": float("nan")})),
        *((name, type(name.title(), (Resolver,), {
            "name": name, "handles": "inequalities", "solve": solve})) for name, solve in (
                ("status", lambda self, h, memory: Resolution(h.start(), "SOLVED")),
                ("array", lambda self, h, memory: h.start()),
                ("one", lambda self, h, memory: Resolution(1.0)),
                ("few", lambda self, h, memory: Resolution(np.zeros(3))),
                ("unknown", lambda self, h, memory: Resolution(np.full(h.n, np.nan))),
                ("attribute", lambda self, h, memory: h.nonsense)))):
    register("resolvers", name)(kind)
