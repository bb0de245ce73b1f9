"""What an MJCF limits and couples: ranges, efforts, joints, closed chains; what a robot lacks."""

from collections import defaultdict
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.polynomial import Polynomial

from hierarchy.problem import Array
from hierarchy.robots.found import Coupled, Loop
from hierarchy.robots.mjcf.model import Built, add_frame, joint_actuators, pose
from hierarchy.robots.mjcf.part import WORLD, Compiled, Part, disabled, name_of
from hierarchy.words import each, listed, some

_FREE: Array = np.array([-np.inf, np.inf])


def set_limits(built: Built) -> Iterator[str]:
    """Set the ranges of hinges and slides; yield a sentence for each missing limit."""
    file, model = built.part.compiled, built.model
    balls, off, free = list[str](), list[str](), disabled(file.model, "limit")
    lower, upper = np.full(model.nq, -np.inf), np.full(model.nq, np.inf)
    for j, joint in built.pairs():
        if file.model.jnt_limited[j] and joint.nq == 1 and not free:
            lower[joint.idx_q], upper[joint.idx_q] = file.model.jnt_range[j]
        elif file.model.jnt_limited[j]:
            (off if free else balls).append(file.joints[j])
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    model.upperVelocityLimit = np.full(model.nv, np.inf)
    yield "velocity limits: an MJCF has none"
    yield from each(("limits of the angle of ball joints are ignored", balls),
                    ("the options of the file disable the position limits", off))


def effort_limits(built: Built) -> Iterator[str]:
    """Set effort limits; yield sentences on joints without, and on limits that differ by sign.

    Actuators on a joint add up; each has the tightest of its force range and, for a motor, its
    control range, times its gear. The joint's own force range caps their sum.
    """
    file, model = built.part.compiled, built.model
    mj, efforts = file.model, np.full(model.nv, np.inf)
    acts = not disabled(mj, "actuation")
    ranges: dict[int, list[Array]] = defaultdict(list)
    known = list(joint_actuators(mj))
    for i, j, gear in known:
        group = int(mj.actuator_group[i])
        if gear and acts and not (group >= 0 and mj.opt.disableactuator >> group & 1):
            ranges[j].append(np.sort(gear * _force(mj, i)))
    idle, uneven = [], []
    for j, joint in built.pairs():
        if joint.nv > 1:
            continue
        total = sum(ranges[j], np.zeros(2)) if j in ranges else _FREE
        if mj.jnt_actfrclimited[j]:
            total = np.clip(total, *mj.jnt_actfrcrange[j])
        idle += [] if j in ranges or mj.jnt_actfrclimited[j] else [file.joints[j]]
        least = float(np.abs(total).min()) if total[0] < 0.0 < total[1] else np.inf
        uneven += [] if -total[0] == total[1] else [
            f"{file.joints[j]} ({total[0]:g} to {total[1]:g})"]
        efforts[joint.idx_v] = least
    model.effortLimit = efforts
    others = [name_of(mj, "actuator", i)
              for i in sorted({*range(mj.nactuator)} - {i for i, _, _ in known})]
    yield from each(
        ("no actuator moves the joint, and nothing limits its effort here", idle if mj.nu else []),
        ("effort limits that differ by sign; the smaller counts both ways, and one of a single "
         "sign not at all", uneven),
        ("actuators that act on a tendon, a site, a body, a crank or a joint of several velocities "
         "are left out", others))


def _force(mj: Any, i: int) -> Array:
    """Return the least and the most force (2,) of an actuator, before its gear."""
    force = np.array(mj.actuator_forcerange[i]) if mj.actuator_forcelimited[i] else _FREE
    if mj.actuator_gaintype[i] or mj.actuator_biastype[i]:  # no motor: fixed gain, no bias
        return force
    control, k = _FREE, mj.actuator_ctrladr[i]
    clamps = mj.actuator_ctrllimited[k] and not disabled(mj, "clampctrl")
    if mj.actuator_dyntype[i] != _INTEGRATOR and clamps:
        control = mj.actuator_ctrlrange[k]
    if mj.actuator_actlimited[i]:
        control = np.clip(control, *mj.actuator_actrange[i])
    known = np.isfinite(control).all()
    return np.clip(np.sort(mj.actuator_gainprm[i, 0] * control), *force) if known else force


_INTEGRATOR = 1  # mjDYN_INTEGRATOR: control is a rate of the activation


_PASSIVE = {"stiffness": ("jnt_stiffness", "jnt_stiffnesspoly"), "friction": ("dof_frictionloss",),
            "damping": ("dof_damping", "dof_dampingpoly", "actuator_damping",
                        "actuator_dampingpoly")}


def left_out(built: Built) -> Iterator[str]:
    """Yield a sentence for each thing that the file has and the robot lacks, or calls otherwise."""
    file, mj = built.part.compiled, built.part.compiled.model
    frames = ((built.bodies, file.bodies), (built.sites, file.sites))
    yield from each(*((said, [name_of(mj, kind, i) for i in range(n)]) for kind, n, said in (
        ("tendon", mj.ntendon, "of tendons only couplings of joints are here"),
        ("flex", mj.nflex, "of flexes only the joints are here"),
        ("skin", mj.nskin, "skins are left out"))))
    if mj.nplugin:
        yield f"plugins of MuJoCo do nothing here: {mj.nplugin}"
    yield from each(
        ("frames with their kind in the name, which another frame has", [
            name for here, there in frames for i, name in here.items() if name != there[i]]),
        ("compensation of gravity is left out", [
            file.bodies[body] for body in np.flatnonzero(mj.body_gravcomp)]),
        ("armature of a free joint: without Coriolis forces", [
            file.joints[j] for j, joint in built.pairs()
            if file.kind(j) == "free" and built.model.armature[joint.idx_v]]))
    if found := [what for what, names in _PASSIVE.items()
                 if any(np.any(getattr(mj, name)) for name in names)]:
        yield f"{listed(found)} of joints: not in the equations of motion"
    if mj.opt.density or mj.opt.viscosity:
        yield "drag of the air or fluid around: not in the equations of motion"


def refuse(file: Compiled) -> None:
    """Raise RobotError for inertia that no robot has: negative, of a tendon, or of its drive."""
    mj = file.model
    if negative := [name for name, v in zip(file.joints, mj.jnt_dofadr, strict=True)
                    if mj.dof_armature[v] < 0.0]:
        raise file.error(f"the armature of {some(negative)} is negative")
    on_joint = {i for i, _, _ in joint_actuators(mj)}
    several = [(kind, int(i)) for kind, inertia in (
        ("tendon", mj.tendon_armature), ("actuator", mj.actuator_armature))
        for i in np.flatnonzero(inertia) if kind == "tendon" or i not in on_joint]
    if several:
        raise file.error("an armature acts on several joints, which a robot here cannot have: "
                         f"{some([f'{kind} {name_of(mj, kind, i)!r}' for kind, i in several])}; "
                         "give it to the joints")


_CONNECT, _WELD, _JOINT, _TENDON = 0, 1, 2, 3  # mjtEq
_WRAP_JOINT = 1                    # mjtWrap
_SITE = 6                          # mjOBJ_SITE
_TURNS = 10                        # of the data of a weld: torquescale, 0 if it lets bodies turn


def couplings(part: Part) -> tuple[tuple[Coupled, ...], list[str]]:
    """Return the joints that are polynomials of others, and sentences on those left out.

    MuJoCo's polynomial is one of differences from the reference positions: here it is expanded. A
    joint that follows one that is held is a constant; one that is held itself follows no longer.
    """
    file, found = part.compiled, []
    mj, said = file.model, []
    for name, one, other, moved in _followers(part):
        if one not in part.joints:
            if other in part.joints:
                said.append(f"{name!r} is left out: joint {file.joints[one]!r} does not move")
            continue
        own = mj.qpos0[mj.jnt_qposadr[one]]
        here = mj.jnt_qposadr[other]
        reference, held = (mj.qpos0[here], part.held[here]) if other >= 0 else (0.0, 0.0)
        q = moved(Polynomial([-reference, 1.0])) + own
        if other in part.joints:
            coefficients = np.trim_zeros(q.coef, "b").tolist()
            found.append(Coupled(file.joints[one], file.joints[other],
                                 tuple(coefficients + [0.0] * (2 - len(coefficients)))))
        else:
            found.append(Coupled(file.joints[one], "", (float(q(held)),)))
    return tuple(found), said


_Follows = tuple[str, int, int, Polynomial]  # name, a joint, another or -1, and how one follows it


def _followers(part: Part) -> Iterator[_Follows]:
    """Yield couplings of joints, and fixed tendons of one or two that keep their length.

    Their polynomials are of differences from the reference.
    """
    mj = part.compiled.model
    for name, i in _active(mj, _JOINT):
        yield name, int(mj.eq_obj1id[i]), int(mj.eq_obj2id[i]), Polynomial(mj.eq_data[i, :5])
    for name, i in _active(mj, _TENDON):
        if weights := _fixed(mj, i):
            weights.sort(key=lambda weight: weight[0] not in part.joints)  # what moves follows
            (one, own), (other, by) = *weights, *[(-1, 0.0)] * (2 - len(weights))
            yield name, one, other, Polynomial([mj.eq_data[i, 0] / own, -by / own])


def _fixed(mj: Any, i: int) -> list[tuple[int, float]]:
    """Return the one or two joints, with their weights, of the tendon that an equality holds.

    The last of the tendon comes first. Empty for another tendon, or one that follows another.
    """
    tendon = int(mj.eq_obj1id[i])
    first = int(mj.tendon_adr[tendon])
    wraps = slice(first, first + int(mj.tendon_num[tendon]))
    weights = [(int(j), float(by)) for j, by in zip(mj.wrap_objid[wraps], mj.wrap_prm[wraps],
                                                    strict=True) if by]
    fixed = (mj.wrap_type[wraps] == _WRAP_JOINT).all() and mj.eq_obj2id[i] < 0
    return weights[::-1] if fixed and 1 <= len(weights) <= 2 else []


def loops(built: Built) -> tuple[tuple[Loop, ...], list[str]]:
    """Return the chains that the file closes, and sentences on equalities left out.

    Frames are added to the model where an anchor is a place on a body and not a site.
    """
    mj, found, said = built.part.compiled.model, [], []
    for kind in (_CONNECT, _WELD):
        for name, i in _active(mj, kind):
            bodies = _bodies(mj, i)
            joints = {built.placed[body][0] for body in bodies}
            if built.part.bodies.issuperset({*bodies} - {WORLD}) and all(  # no mocap places it
                    mj.body_mocapid[mj.body_rootid[body]] < 0 for body in bodies):
                if len(joints) == 2:  # else nothing moves between its ends
                    ends = (_anchor(built, i, 0, name), _anchor(built, i, 1, name))
                    found.append(Loop(name, ends, kind == _WELD and bool(mj.eq_data[i, _TURNS])))
            elif any(joints):
                said.append(f"equality {name!r} is left out: a body of it is not of the robot")
    idle = [_name(mj, i) for i in range(mj.neq) if not _acts(mj, i)]
    others = [name for kind in set(mj.eq_type.tolist()) - {_CONNECT, _WELD, _JOINT}
              for name, i in _active(mj, kind) if kind != _TENDON or not _fixed(mj, i)]
    said += each(("equalities that are not active are left out", idle),
                 ("equalities of flexes, distances and some tendons are left out", others))
    return tuple(found), said


def _active(mj: Any, kind: int) -> Iterator[tuple[str, int]]:
    yield from ((_name(mj, i), i) for i in range(mj.neq)
                if mj.eq_type[i] == kind and _acts(mj, i))


def _acts(mj: Any, i: int) -> bool:
    return bool(mj.eq_active0[i]) and not disabled(mj, "equality")


def _name(mj: Any, i: int) -> str:
    kinds = {_CONNECT: "connect", _WELD: "weld", _JOINT: "coupling"}
    return str(mj.equality(i).name or f"{kinds.get(int(mj.eq_type[i]), 'equality')} {i}")


def _bodies(mj: Any, i: int) -> list[int]:
    ids = [int(mj.eq_obj1id[i]), int(mj.eq_obj2id[i])]
    return [int(mj.site_bodyid[one]) for one in ids] if mj.eq_objtype[i] == _SITE else ids


def _anchor(built: Built, i: int, end: int, name: str) -> str:
    """Return the frame of an end of a loop."""
    mj = built.part.compiled.model
    body = _bodies(mj, i)[end]
    if mj.eq_objtype[i] == _SITE:
        return built.sites[int((mj.eq_obj1id, mj.eq_obj2id)[end][i])]
    joint, place = built.placed[body]
    data, welded = mj.eq_data[i], mj.eq_type[i] == _WELD
    at = 3 * (1 - end if welded else end)  # MuJoCo stores the anchors of a weld in reverse
    turn = data[6:10] if welded and end == 0 else _UPRIGHT
    return add_frame(built.model, f"{name} {end + 1}", joint, place * pose(data[at:at + 3], turn),
                     "anchor")


_UPRIGHT: Array = np.array([1.0, 0.0, 0.0, 0.0])


def pairs_apart(built: Built) -> tuple[tuple[str, str], ...]:
    """Return pairs of joints, "" for the base, none of whose bodies the file lets collide."""
    mj, of_joint = built.part.compiled.model, dict[int, set[int]]()
    for body in sorted(built.part.bodies | {WORLD}):
        if mj.body_geomnum[body]:
            of_joint.setdefault(built.placed[body][0], set()).add(body)
    excluded = {frozenset((int(pair) >> 16, int(pair) & 0xFFFF)) for pair in mj.exclude_signature}
    names = ["", *list(built.model.names)[1:]]
    joints = dict.fromkeys(
        tuple(sorted(built.placed[body][0] for body in pair)) for pair in excluded
        if len(pair) == 2)
    return tuple((names[a], names[b]) for a, b in joints if a != b and all(
        frozenset((one, other)) in excluded for one in of_joint.get(a, ())
        for other in of_joint.get(b, ())))
