"""The studies: which scenarios, with which changes, under which resolver, from how many starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from scenarios.config import Scenario, load
from scenarios.config.groups import load_group
from scenarios.config.scenario import OWN

STARTS = 16
SEED = 14


@dataclass(frozen=True)
class Column:
    """One column of a study: a scenario with changes at dotted keys, under a resolver."""

    name: str
    scenario: str
    resolver: str
    changes: Mapping[str, Any] = field(default_factory=dict)

    def load(self) -> Scenario:
        """Return the scenario, named after the column."""
        scenario = load(self.scenario, {**self.changes, "name": self.name})
        return scenario.with_resolver(self.resolver)


@dataclass(frozen=True)
class Study:
    """Columns that are run from the same sampled starts."""

    name: str
    title: str
    columns: tuple[Column, ...]
    starts: int = STARTS


@dataclass(frozen=True)
class Pair:
    """Two resolvers, as specs, whose answers to every tick are compared."""

    name: str
    first: str
    second: str


@dataclass(frozen=True)
class Pivot:
    """A level of one row, whose share outside the rows above it is measured in every tick."""

    name: str


@dataclass(frozen=True)
class Watched:
    """What is measured in every tick of runs of `scenario` under `resolver`."""

    name: str
    title: str
    scenario: str
    resolver: str
    columns: tuple[Pair | Pivot, ...]
    starts: int = STARTS


def _variants(scenario: str, resolvers: Mapping[str, str]) -> tuple[Column, ...]:
    return tuple(Column(name, scenario, resolver) for name, resolver in resolvers.items())


def _blended(prefix: str, scenario: str) -> tuple[Column, ...]:
    return (Column(prefix, scenario, OWN), *(
        Column(f"{prefix}-blend-{time:g}", scenario, OWN,
               {"control.transition": "blend", "control.transition_time": time})
        for time in (0.02, 0.1)))


LETTER = Study("letter", "The letter's scheme", (
    Column("ellipse", "ellipse", OWN),
    Column("velocity", "ellipse-velocity", OWN),
    Column("35deg", "ellipse-35deg", OWN),
    Column("35deg-equality", "ellipse-35deg-equality", OWN),
    Column("3d", "ellipse-3d", OWN),
    Column("3d-published", "ellipse-3d", OWN, {"avoidance.jacobian": "published",
                                               "control.jacobian_derivative": "difference"}),
    Column("published", "ellipse-published", OWN),
    Column("differences", "ellipse", OWN, {"control.jacobian_derivative": "difference"}),
    Column("undamped", "ellipse", OWN, {"control.options.damping": 0.0})))

RESOLVERS = Study("resolvers", "All resolvers on one task", (
    Column("ellipse", "ellipse", "tpm"),
    *_variants("ellipse", {"ellipse-weighted": "weighted", "ellipse-augmented": "augmented"}),
    *_variants("ellipse-limits", {
        "limits-tpm": "tpm", "limits-sns": "sns",
        "limits-sns-optimal": "sns:form=optimal", "limits-hcod": "hcod",
        "limits-weighted": "weighted"}),
    *_variants("ellipse-hqp", {"hqp-hcod": "hcod", "hqp-weighted": "weighted"})))

BLEND = Study("blend", "Switching without jumps", (
    *_blended("velocity", "ellipse-velocity"), *_blended("ellipse", "ellipse")))

LADDER = Study("ladder", "From the letter's scheme to inequalities, one change at a time", tuple(
    Column(name, name, OWN) for name in load_group("ladder").scenarios))

INERTIA = Study("inertia", "Null-space damping by the inertia matrix", (
    Column("identity", "ellipse", OWN), *(
        Column(f"inertia-{k:g}", "ellipse-inertia", OWN, {"damping.value": k})
        for k in (1.0, 5.0, 20.0))))

RIVALS = Study("rivals", "Other ways to avoid obstacles", (
    Column("algorithm-1", "ellipse", OWN), Column("algorithm-1-velocity", "ellipse-velocity", OWN),
    Column("nullspace", "ellipse-nullspace", OWN),
    Column("danger-bounds", "ellipse-danger-bounds", OWN),
    Column("set-based-velocity", "ellipse-set-based", OWN),
    Column("smooth-velocity", "ellipse-smooth", OWN), Column("barrier", "ellipse-hqp", OWN)))

_DAMPINGS = {
    "pivots": "tpm-published", "level": "tpm",
    "nakamura": "recursive:method=nakamura:threshold=0.05",
    "chiaverini": "recursive:method=chiaverini",
    "selective": "recursive:method=selective:largest=2.0"}  # rad/s
_ACCELERATIONS = _DAMPINGS | {"selective": "recursive:method=selective:largest=10.0"}  # rad/s^2

SINGULAR = Study("singular", "Through singularities and out of reach", (
    *_variants("singular", _DAMPINGS), Column("limits", "singular-limits", OWN),
    *_variants("singular-acceleration", {
        f"acceleration-{name}": spec for name, spec in _ACCELERATIONS.items()}),
    Column("acceleration-limits", "singular-acceleration-limits", OWN)))

HUMAN = Study("human", "A hand, a depth camera, an arm under position control", (
    Column("human", "human", OWN),
    Column("human-nearest", "human", OWN, {"avoidance.direction": "nearest"}),
    Column("human-hqp", "human-hqp", OWN)))

_PUSHED = {"control.duration": 1.5}
_UNKNOWN = {**_PUSHED, "plant.joint_friction": 1.0, "plant.delay": 0.002}  # N m, s
GIVING = {"tasks.0.give": 0.2, "tasks.1.give": 5.0, "tasks.2.give": 5.0}  # m/s^2

STANDING = Study("standing", "A humanoid that is pushed", (
    Column("strict", "stand-push", "hcod", _PUSHED),
    Column("give", "stand-push", "hcod", {**GIVING, **_PUSHED}),
    Column("weighted", "stand-push", "weighted", _PUSHED),
    Column("bounds", "stand-push", "tpm", {"limits.place": "bounds", **_PUSHED}),
    Column("equalities", "stand-push", "tpm", _PUSHED),
    Column("strict-unknown", "stand-push", "hcod", _UNKNOWN),
    Column("weighted-unknown", "stand-push", "weighted", _UNKNOWN)))

REACHING = Study("reaching", "A humanoid that is asked to reach too far", (
    Column("strict", "reach-torque", "hcod"),
    Column("weighted", "reach-torque", "weighted"),
    Column("hand-first", "reach-torque-hand-first", "hcod"),
    Column("equalities", "reach-torque", "tpm")))

STATES = Watched("states", "Resolvers in the same states", "ellipse", "tpm", (
    *(Pair(name, "tpm", name) for name in ("recursive", "hcod", "weighted", "augmented")),
    Pair("published", "tpm", "tpm-published"),
    *(Pair(f"{name}-undamped", "tpm:damping=0.0", f"{name}:damping=0.0")
      for name in ("recursive", "hcod", "weighted", "augmented")),
    Pair("published-undamped", "tpm:damping=0.0", "tpm-published:damping=0.0")))

THROTTLE = Watched("throttle", "What damping leaves of avoidance", "ellipse", "tpm",
                   (Pivot("avoidance"),))

AnyStudy = Study | Watched

STUDIES: tuple[AnyStudy, ...] = (
    STATES, THROTTLE, LETTER, RESOLVERS, BLEND, LADDER, INERTIA, RIVALS, SINGULAR, HUMAN,
    STANDING, REACHING)
