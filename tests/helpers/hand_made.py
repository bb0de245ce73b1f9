"""Recordings made by hand, whose every number is known."""

import numpy as np

from hierarchy import Robot
from scenarios.config import load
from scenarios.config.sections.tasks import PositionSection
from scenarios.recording.facts import facts_of
from scenarios.recording.recording import Recording

ROBOT = Robot.named("kuka_lwr")


def asked(resolver="tpm", name="hand-made", **changes):
    """`ellipse` with a cone of 60 degrees, its position at rest, and other changes."""
    scenario = load("ellipse", {"name": name, "pointing.alpha_d": 60.0, "control.duration": 4.0})
    return scenario.with_resolver(resolver).model_copy(
        update={"position": PositionSection(), **changes})


def recording(scenario=None, fault=None, orders=("a", "b"), **changed):
    """Five ticks, one second apart, joints at rest, every signal there and quiet."""
    ticks = len(changed.get("t", range(5)))
    joints = np.shape(changed.get("q", np.empty((ticks, 7))))[1]
    signals = {
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
    scenario = scenario or asked()
    return Recording(signals, orders, scenario, facts_of(scenario, ROBOT), fault)
