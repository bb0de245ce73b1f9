"""The numbers of a scenario that sliders of a live page change."""

from __future__ import annotations

from typing import NamedTuple

from scenarios.config import Scenario


class Knob(NamedTuple):
    """A number in a scenario, by its dotted key, and the range of its slider."""

    key: str
    label: str
    high: float
    step: float


_BOTH = (
    Knob("pointing.alpha_d", "Cone, half angle [deg]", 90.0, 0.5),
    Knob("avoidance.near", "Body, near distance [m]", 0.4, 0.005),
    Knob("avoidance.far", "Body, far distance [m]", 0.4, 0.005),
    Knob("avoidance.end_effector", "End effector, distance [m]", 0.4, 0.005),
    Knob("avoidance.distance", "Distance kept [m]", 0.3, 0.005),
    Knob("avoidance.influence", "Influence from [m]", 0.8, 0.01),
    Knob("avoidance.rate", "Approach rate [1/s]", 40.0, 0.5),
    Knob("limits.acceleration", "Joint acceleration [rad/s²]", 40.0, 0.5),
    Knob("damping.value", "Joint damping [1/s]", 20.0, 0.1))
_ACCELERATION = (
    Knob("position.stiffness", "Path, stiffness [1/s²]", 200.0, 1.0),
    Knob("position.damping", "Path, damping [1/s]", 60.0, 0.5),
    Knob("pointing.stiffness", "Cone, stiffness [1/s²]", 100.0, 0.5),
    Knob("pointing.damping", "Cone, damping [1/s]", 40.0, 0.5))
_VELOCITY = (
    Knob("position.gain", "Path, gain [1/s]", 50.0, 0.5),
    Knob("pointing.gain", "Cone, gain [1/s]", 50.0, 0.5))


def knobs(scenario: Scenario) -> list[tuple[Knob, float]]:
    """Return those of the settings that a scenario has, with their values."""
    gains = _ACCELERATION if scenario.control.level == "acceleration" else _VELOCITY
    values = ((knob, _value(scenario, knob.key)) for knob in (*_BOTH, *gains))
    return [(knob, value) for knob, value in values if value is not None]


def _value(scenario: Scenario, key: str) -> float | None:
    found: object = scenario
    for name in key.split("."):
        found = getattr(found, name, None)
    return float(found) if isinstance(found, int | float) else None
