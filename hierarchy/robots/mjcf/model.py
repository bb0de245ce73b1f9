"""The model of pinocchio for a robot in a compiled MJCF, compared with MuJoCo's.

MuJoCo moves a body by several joints in turn, each at a place of its own on the body; here each is
a joint of its own, at that place and with the axes of the body. q is MuJoCo's qpos, but for the
order of quaternions: x, y, z, w here and w, x, y, z there. The velocity of a free joint is in the
frame of the body, in MuJoCo its linear part is in the world's.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hierarchy.problem import Array
from hierarchy.robots.from_table import ROOT
from hierarchy.robots.joints import check_size
from hierarchy.robots.library import pin
from hierarchy.robots.mjcf.part import SIZES, WORLD, Part, disabled, rolled


@dataclass(frozen=True)
class Built:
    """A `model` of pinocchio, its part of the file, and what became of joints, bodies and sites.

    `joints` has the index here of each joint of MuJoCo that moves, `placed` the joint here and the
    place on it of each body of MuJoCo; `bodies` and `sites` have their frames by index.
    """

    part: Part
    model: Any
    joints: dict[int, int] = field(default_factory=dict)
    placed: list[tuple[int, Any]] = field(default_factory=list)
    bodies: dict[int, str] = field(default_factory=dict)
    sites: dict[int, str] = field(default_factory=dict)

    def pairs(self) -> Iterator[tuple[int, Any]]:
        """Yield each joint that moves: its index in MuJoCo, and the joint of pinocchio."""
        for j, here in self.joints.items():
            yield j, self.model.joints[here]


def build(part: Part) -> Built:
    """Build the model: joints, inertias, armature, gravity and frames, but no limits."""
    mj, built = part.compiled.model, Built(part, pin.Model())
    built.model.name = str(part.compiled.file)
    weight = 0.0 if disabled(mj, "gravity") else 1.0
    built.model.gravity.linear = weight * np.array(mj.opt.gravity)
    base = 0
    if part.on_base:
        base = _add(built.model, 0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), ROOT)
    built.placed.append((base, pin.SE3.Identity()))
    for body in range(1, mj.nbody):
        _place(built, body)
    for body in sorted(part.bodies):
        joint, place = built.placed[body]
        R = pose(np.zeros(3), mj.body_iquat[body]).rotation
        inertia = pin.Inertia(mj.body_mass[body], mj.body_ipos[body],
                              R @ np.diag(mj.body_inertia[body]) @ R.T)
        built.model.appendBodyToJoint(joint, inertia, place)
        if body != WORLD:
            built.bodies[body] = add_frame(built.model, part.compiled.bodies[body], joint, place,
                                           "body")
    for site in range(mj.nsite):
        if (body := int(mj.site_bodyid[site])) in part.bodies | {WORLD}:  # a loop may end there
            joint, place = built.placed[body]
            built.sites[site] = add_frame(
                built.model, part.compiled.sites[site], joint,
                place * pose(mj.site_pos[site], mj.site_quat[site]), "site")
    _set_armature(built)
    return built


def _place(built: Built, body: int) -> None:
    """Add the joints of a body that move, and note the joint that carries it, and where."""
    part, mj = built.part, built.part.compiled.model
    parent, place = built.placed[mj.body_parentid[body]]
    place = place * pose(mj.body_pos[body], mj.body_quat[body])
    first = mj.body_jntadr[body]
    for j in range(first, first + mj.body_jntnum[body]):
        kind, axis = part.compiled.kind(j), np.array(mj.jnt_axis[j])
        at = pin.SE3(np.eye(3), np.array(mj.jnt_pos[j]))
        here = mj.jnt_qposadr[j]
        if kind == "free":  # its position is that of the body in the world
            at = place = pin.SE3.Identity()
        if j in part.joints:
            reference = _motion(kind, axis, -mj.qpos0[here:here + 1]) if kind in _ALONG else (
                pin.SE3.Identity())
            joint = _MODELS[kind](*([axis] if kind in _ALONG else []))
            parent = built.joints[j] = _add(built.model, parent, joint, place * at * reference,
                                            part.compiled.joints[j])
            place = at.inverse()
        else:
            q = part.held[here:here + sum(SIZES[kind])]
            if kind in _ALONG:
                q = q - mj.qpos0[here]
            place = place * at * _motion(kind, axis, q) * at.inverse()
    built.placed.append((parent, place))


_ALONG = ("slide", "hinge")


_MODELS = {"slide": pin.JointModelPrismaticUnaligned, "hinge": pin.JointModelRevoluteUnaligned,
           "free": pin.JointModelFreeFlyer, "ball": pin.JointModelSpherical}


def _motion(kind: str, axis: Array, q: Array) -> Any:
    """Return how a joint of MuJoCo at q moves its body."""
    if kind == "free":
        return pose(q[:3], q[3:])
    if kind == "ball":
        return pose(np.zeros(3), q)
    if kind == "slide":
        return pin.SE3(np.eye(3), axis * q[0])
    return pin.SE3(pin.AngleAxis(float(q[0]), axis).toRotationMatrix(), np.zeros(3))


def pose(position: Array, quaternion: Array) -> Any:
    """Return a placement with a quaternion w, x, y, z of MuJoCo."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return pin.SE3(pin.Quaternion(w, x, y, z).toRotationMatrix(), np.array(position))


def _add(model: Any, parent: int, joint: Any, place: Any, name: str) -> int:
    index = int(model.addJoint(parent, joint, place, name))
    model.addJointFrame(index, -1)
    return index


def add_frame(model: Any, name: str, joint: int, place: Any, kind: str) -> str:
    """Add a frame and return its name, which has the kind in it if another frame has the name.

    A body that is the frame of its joint, by name and place, gets no other.
    """
    if model.existFrame(name):
        same = model.frames[model.getFrameId(name)]
        if same.parentJoint == joint and same.placement.isApprox(place, 1e-12):
            return name
    while model.existFrame(name):
        name += f" ({kind})"
    model.addFrame(pin.Frame(name, joint, place, pin.FrameType.OP_FRAME))
    return name


def _set_armature(built: Built) -> None:
    """Set the inertia of drives: of joints, and through their gears of actuators on joints."""
    mj = built.part.compiled.model
    inertia = np.array(mj.dof_armature)
    for i, j, gear in joint_actuators(mj):
        inertia[mj.jnt_dofadr[j]] += gear**2 * armature(mj, "actuator", len(mj.actuator_trnid))[i]
    total = np.array(built.model.armature)
    for j, joint in built.pairs():
        here = mj.jnt_dofadr[j]
        total[joint.idx_v:joint.idx_v + joint.nv] = inertia[here:here + joint.nv]
    built.model.armature = total


def armature(mj: Any, kind: str, count: int) -> Array:
    """Return the armature of each tendon or actuator; older MuJoCo has none."""
    return np.asarray(getattr(mj, f"{kind}_armature", np.zeros(count)))


def joint_actuators(mj: Any) -> Iterator[tuple[int, int, float]]:
    """Yield the index, the joint and the gear of each actuator that moves one hinge or slide."""
    for i in range(len(mj.actuator_trnid)):
        j = int(mj.actuator_trnid[i, 0])
        if mj.actuator_trntype[i] in _ON_JOINT and mj.jnt_type[j] in _SCALAR:
            yield i, j, float(mj.actuator_gear[address(mj, "out", i), 0])


def address(mj: Any, what: str, i: int) -> int:
    """Return the index of the first "ctrl" or "out" of an actuator; in older MuJoCo it has one."""
    addresses = getattr(mj, f"actuator_{what}adr", None)
    return i if addresses is None else int(addresses[i])


_ON_JOINT = (0, 1)  # mjTRN_JOINT, mjTRN_JOINTINPARENT
_SCALAR = (2, 3)    # mjJNT_SLIDE, mjJNT_HINGE


def configuration(built: Built, qpos: Array) -> Array:
    """Return q (nq,) for a qpos (nq,) of MuJoCo, its quaternions made unit length."""
    mj, q = built.part.compiled.model, np.array(pin.neutral(built.model))
    for j, joint in built.pairs():
        here = mj.jnt_qposadr[j]
        q[joint.idx_q:joint.idx_q + joint.nq] = rolled(qpos[here:here + joint.nq], -1)
    return np.asarray(pin.normalize(built.model, q))


_SAME = 1e-9       # relative to the robot's size, and to the inertias of the two joints of an entry
_ROUNDING = 1e-13  # of M, relative to its largest entry
_SAMPLES = 2       # besides the reference configuration
_REACH = 1.0       # [rad or m] from it


def compare(built: Built) -> None:
    """Raise RobotError, naming the body, where a model differs from MuJoCo's by more than 1e-9."""
    import mujoco

    file, model = built.part.compiled, built.model
    check_size(model, f"robot file {file.file!r}")
    mj, data, own = file.model, mujoco.MjData(file.model), model.createData()
    steps = np.random.default_rng(0).uniform(-_REACH, _REACH, (_SAMPLES, model.nv))
    if built.part.on_base:  # which MuJoCo has not
        steps[:, :6] = 0.0
    for step in (np.zeros(model.nv), *steps):
        q = np.asarray(pin.integrate(model, configuration(built, mj.qpos0), step))
        data.qpos[:] = built.part.held
        for j, joint in built.pairs():
            here = mj.jnt_qposadr[j]
            data.qpos[here:here + joint.nq] = rolled(q[joint.idx_q:joint.idx_q + joint.nq], 1)
        for stage in ("mj_kinematics", "mj_comPos", "mj_tendon", "mj_transmission", "mj_makeM"):
            getattr(mujoco, stage)(mj, data)
        pin.framesForwardKinematics(model, own, q)
        for what, found, expected in (
                *_frames(built, own, "body", built.bodies, data.xpos, data.xmat),
                *_frames(built, own, "site", built.sites, data.site_xpos, data.site_xmat)):
            off = np.abs(found - expected).max()
            if not off <= _SAME * max(1.0, np.abs(expected).max()):
                raise file.error(f"{what} is {off:.2g} from where MuJoCo has it")
        _compare_inertia(built, q, pin.crba(model, own, q), data, mujoco.mj_mulM)


def _frames(built: Built, own: Any, kind: str, frames: dict[int, str], positions: Array,
            rotations: Array) -> Iterator[tuple[str, Array, Array]]:
    index = {frame.name: i for i, frame in enumerate(built.model.frames)}
    for i, name in frames.items():
        found = own.oMf[index[name]]
        yield (f"{kind} {name!r}", np.column_stack([found.translation, found.rotation]),
               np.column_stack([positions[i], rotations[i].reshape(3, 3)]))


def _compare_inertia(built: Built, q: Array, M: Array, data: Any, times: Any) -> None:
    """Compare the rows and columns of the joints that both have."""
    file, columns = built.part.compiled, np.zeros((built.model.nv, built.part.compiled.model.nv))
    for j, joint in built.pairs():
        here, there = slice(joint.idx_v, joint.idx_v + joint.nv), file.model.jnt_dofadr[j]
        columns[here, there:there + joint.nv] = np.eye(joint.nv)
        if file.kind(j) == "free":  # its linear velocity is in the body's frame here
            turn = pin.Quaternion(q[joint.idx_q + 3:joint.idx_q + 7]).toRotationMatrix()
            columns[here, there:there + 3][:3] = turn.T
    products = np.zeros_like(columns)
    for row, product in zip(columns, products, strict=True):
        times(file.model, data, product, row)
    both = columns.any(axis=1)
    off = np.abs(np.triu(M - products @ columns.T)[np.ix_(both, both)])
    own = np.sqrt(np.diag(M)[both])
    allowed = _SAME * np.outer(own, own) + _ROUNDING * np.abs(M).max(initial=0.0)
    for row, column in np.argwhere(~(off <= allowed)):
        v = np.flatnonzero(both)[column]
        j = next(j for j, joint in built.pairs() if joint.idx_v <= v < joint.idx_v + joint.nv)
        raise file.error(f"the inertia at body {file.bodies[file.model.jnt_bodyid[j]]!r} is "
                         f"{off[row, column]:.2g} from what MuJoCo has")
