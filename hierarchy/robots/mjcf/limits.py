"""Limits of the joints of an MJCF: ranges, what their actuators can do; and what a robot lacks."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np

from hierarchy.problem import Array
from hierarchy.robots.mjcf.compiled import Compiled, name_of
from hierarchy.robots.mjcf.model import Built, address, armature, joint_actuators
from hierarchy.robots.mjcf.part import Part
from hierarchy.words import each, listed, some

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
    yield from each(("limits of the angle of ball joints are ignored", balls))


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
    known = {i for i, _, _ in joint_actuators(mj)}
    others = [name_of(mj, "actuator", i) for i in range(len(mj.actuator_trnid)) if i not in known]
    yield from each(
        ("no actuator moves the joint, and nothing limits its effort here", idle if mj.nu else []),
        ("effort limits that differ by sign; the smaller counts both ways, and one of a single "
         "sign not at all", uneven),
        ("actuators that act on a tendon, a site, a body, a crank or a joint of several velocities "
         "are left out", others))


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


def left_out(part: Part) -> Iterator[str]:
    """Yield a sentence for each thing that the file has and the robot lacks."""
    mj = part.compiled.model
    yield from each(*((said, [name_of(mj, kind, i) for i in range(n)]) for kind, n, said in (
        ("tendon", mj.ntendon, "of tendons only couplings of joints are here"),
        ("flex", mj.nflex, "of flexes only the joints are here"),
        ("skin", mj.nskin, "skins are left out"))))
    if mj.nplugin:
        yield f"plugins of MuJoCo do nothing here: {mj.nplugin}"
    yield from each(("compensation of gravity is left out", [
        part.compiled.bodies[body] for body in np.flatnonzero(mj.body_gravcomp)]))
    passive = {"stiffness": mj.jnt_stiffness, "damping": mj.dof_damping,
               "friction": mj.dof_frictionloss}
    if found := [what for what, values in passive.items() if np.any(values)]:
        yield f"{listed(found)} of joints: not in the equations of motion"


def refuse(file: Compiled) -> None:
    """Raise RobotError for inertia that no body or joint has: that of a tendon, or of its drive."""
    mj = file.model
    drives = armature(mj, "actuator", len(mj.actuator_trnid))
    on_joint = {i for i, _, _ in joint_actuators(mj)}
    heavy = [f"tendon {name_of(mj, 'tendon', i)!r}" for i in range(mj.ntendon)
             if armature(mj, "tendon", mj.ntendon)[i]]
    heavy += [f"actuator {name_of(mj, 'actuator', i)!r}" for i in range(len(drives))
              if i not in on_joint and drives[i]]
    if heavy:
        raise file.error("an armature acts on several joints, which a robot here cannot have: "
                         f"{some(heavy)}; give it to the joints")
