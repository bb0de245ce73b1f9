"""Limits of the joints of an MJCF: ranges, and what their actuators can do."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np

from hierarchy.problem import Array
from hierarchy.robots.mjcf.compiled import Compiled, name_of
from hierarchy.robots.mjcf.model import Built, address, joint_actuators
from hierarchy.words import some

_FREE: Array = np.array([-np.inf, np.inf])


def set_limits(built: Built) -> Iterator[str]:
    """Set the ranges of hinges and slides; yield a sentence for each missing limit."""
    file, model = built.part.compiled, built.model
    mj, lower, upper = file.model, np.array(model.lowerPositionLimit), np.array(
        model.upperPositionLimit)
    balls = []
    for j, joint in built.pairs():
        limited = bool(mj.jnt_limited[j])
        if joint.nq > 1:
            lower[joint.idx_q:joint.idx_q + joint.nq] = -np.inf
            upper[joint.idx_q:joint.idx_q + joint.nq] = np.inf
            balls += [file.joints[j]] if limited else []
            continue
        lower[joint.idx_q], upper[joint.idx_q] = mj.jnt_range[j] if limited else _FREE
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    model.upperVelocityLimit = np.full(model.nv, np.inf)
    yield "velocity limits: an MJCF has none"
    if balls:
        yield f"limits of the angle of ball joints are ignored: {some(balls)}"


def effort_limits(built: Built) -> Iterator[str]:
    """Set effort limits; yield sentences on joints without, and on limits that differ by sign.

    Actuators on a joint add up; each has the tightest of its force range and, for a motor, its
    control range, times its gear. The joint's own force range caps their sum.
    """
    file, model = built.part.compiled, built.model
    mj, efforts = file.model, np.full(model.nv, np.inf)
    ranges: dict[int, list[Array]] = defaultdict(list)
    for i, j, gear in joint_actuators(mj):
        ranges[j].append(np.sort(gear * _force(mj, i)) if gear else np.zeros(2))
    idle, uneven = [], []
    for j, joint in built.pairs():
        if joint.nv > 1:
            continue
        total = sum(ranges[j], np.zeros(2)) if j in ranges else _FREE
        if mj.jnt_actfrclimited[j]:
            total = np.clip(total, *mj.jnt_actfrcrange[j])
        idle += [] if j in ranges else [file.joints[j]]
        least = float(np.abs(total).min()) if total[0] < 0.0 < total[1] else np.inf
        uneven += [] if -total[0] == total[1] else [
            f"{file.joints[j]} ({total[0]:g} to {total[1]:g})"]
        efforts[joint.idx_v] = least
    model.effortLimit = efforts
    if idle and mj.nu:
        yield f"no actuator moves the joint, and nothing limits its effort here: {some(idle)}"
    if uneven:
        yield ("effort limits that differ by sign; the smaller counts both ways, and one of a "
               f"single sign not at all: {some(uneven)}")
    yield from _elsewhere(file)


def _force(mj: Any, i: int) -> Array:
    """Return the least and the most force (2,) of an actuator, before its gear."""
    force = np.array(mj.actuator_forcerange[i]) if mj.actuator_forcelimited[i] else _FREE
    motor = not mj.actuator_gaintype[i] and not mj.actuator_biastype[i]  # fixed gain, no bias
    k = address(mj, "ctrl", i)
    if motor and mj.actuator_dyntype[i] != _INTEGRATOR and mj.actuator_ctrllimited[k]:
        control = np.sort(mj.actuator_gainprm[i, 0] * mj.actuator_ctrlrange[k])
        force = np.clip(control, *force)
    return force


_INTEGRATOR = 1  # mjDYN_INTEGRATOR: control is a rate of the activation


def _elsewhere(file: Compiled) -> Iterator[str]:
    """Yield what acts on anything but one hinge or slide."""
    mj = file.model
    known = {i for i, _, _ in joint_actuators(mj)}
    others = [name_of(mj, "actuator", i) for i in range(len(mj.actuator_trnid)) if i not in known]
    if others:
        yield ("actuators that act on a tendon, a site, a body, a crank or a joint of several "
               f"velocities are left out: {some(others)}")
