"""Recordings and scenarios made by hand, whose every number is known."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from hierarchy import Robot
from scenarios.config.avoidance import ObstacleSection
from scenarios.config.robot import RobotSection
from scenarios.config.sensor import FramesSection
from scenarios.config.tasks import PointingSection, PositionSection
from scenarios.recording.facts import Facts, ResolverFacts, RobotFacts, robot_facts
from scenarios.recording.recording import Recording


@dataclass(frozen=True)
class HandMadeResolver:
    """As much of a Resolver as the facts of a run have."""

    name: str

    @property
    def label(self) -> str:
        return self.name

    @property
    def strict(self) -> bool:
        return self.name not in ("tpm-published", "augmented")

    accuracy = 1e-9
    damping = 0.0
    handles = "equalities"


@dataclass(frozen=True)
class HandMadeScenario:
    """As much of a Scenario as metrics, figures and reports read."""

    name: str = "hand-made"
    title: str = "A run made by hand"
    description: str = "Nothing was simulated."
    resolver: str = "tpm"
    tasks: tuple[Any, ...] = ()
    contacts: tuple[Any, ...] = ()
    position: Any = field(default_factory=PositionSection)
    pointing: Any = field(default_factory=lambda: PointingSection(
        axis=(1.0, 0.0, 0.0), alpha_d=60.0))
    avoidance: Any = field(default_factory=lambda: SimpleNamespace(
        thresholds={"near": 0.05, "far": 0.15}, tip_thresholds={"tip": 0.1}, dimension=1,
        promised={"body": 0.05},
        obstacles=[[0.1, 0.5, 0.1]],
        placed=(ObstacleSection(shape="point", centre=(0.1, 0.5, 0.1)),)))
    control: Any = field(default_factory=lambda: SimpleNamespace(
        level="acceleration", resolver="tpm", options={}, period=0.001, duration=4.0,
        jacobian_derivative="exact"))
    robot: Any = field(default_factory=lambda: RobotSection(model="kuka_lwr"))
    sensor: Any = field(default_factory=lambda: FramesSection(kind="frames", folder="hand"))

    def with_resolver(self, spec: str) -> HandMadeScenario:
        return replace(self, resolver=spec)

    @property
    def is_experiment(self):
        return False

    @property
    def limits_in_stack(self):
        return False

    @property
    def asks(self):
        return "equalities"

    def make_resolver(self) -> Any:
        return HandMadeResolver(self.resolver)

    def to_toml(self) -> str:
        return f'name = "{self.name}"\n'


@cache
def kuka() -> RobotFacts:
    return robot_facts(Robot.named("kuka_lwr"), 0.31)


def facts(spec: str) -> Facts:
    resolver = HandMadeResolver(spec)
    return Facts(kuka(), ResolverFacts(spec, resolver.label, resolver.strict, resolver.accuracy,
                                       "equalities", {}, ""), "equalities", False)


def recording(scenario: Any = None, fault: str | None = None, orders: tuple[str, ...] = ("a", "b"),
              **changed: Any) -> Recording:
    """Five ticks, one second apart, joints at rest, every signal there and quiet."""
    ticks = len(changed.get("t", range(5)))
    joints = np.shape(changed.get("q", np.empty((ticks, 7))))[1]
    signals: dict[str, Any] = {
        "t": np.arange(float(ticks)), "order": np.zeros(ticks, int), "status": np.zeros(ticks, int),
        "iterations": np.ones(ticks, int),
        **{name: np.zeros((ticks, joints)) for name in ("q", "v", "a", "command")},
        **{name: np.zeros((ticks, 3)) for name in ("ee_position", "desired_position",
                                                   "position_error")},
        "pointing_error": np.full(ticks, -0.1), "pointing_active": np.zeros(ticks, bool),
        "control_point_distance": np.ones((ticks, 8)), "minimal_distance": np.ones(ticks),
        "active_control_point": np.full(ticks, -1), "ee_distance": np.ones(ticks),
        "repulsion_active": np.zeros(ticks, bool),
        **{f"time_{part}": np.full(ticks, 1e-6) for part in ("kinematics", "rows", "resolve")},
        "time_tick": np.full(ticks, 4e-6), "joint_lower": np.full(joints, -2.0),
        "joint_upper": np.full(joints, 2.0), "velocity_limit": np.full(joints, np.inf)}
    signals |= {name: np.asarray(value) for name, value in changed.items()}
    scenario = scenario or HandMadeScenario()
    return Recording(signals, orders, scenario, facts(getattr(scenario, "resolver", "tpm")), fault)
