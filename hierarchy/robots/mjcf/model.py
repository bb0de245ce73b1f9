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
from hierarchy.robots.from_table import add_joint, empty
from hierarchy.robots.joints import check_size
from hierarchy.robots.library import pin
from hierarchy.robots.mjcf.part import WORLD, Part, disabled


@dataclass(frozen=True)
class Built:
    """A `model` of pinocchio, its part of the file, and what became of joints, bodies and sites.

    `joints` has the index here of each joint of MuJoCo that moves, `placed` the joint here and the
    place on it of each body of MuJoCo; `bodies` and `sites` have their frames by index. `qpos` and
    `dofs` are the indices in MuJoCo of the last entries of q and of v, all but those of the base
    that it has not.
    """

    part: Part
    model: Any
    joints: dict[int, int] = field(default_factory=dict)
    placed: list[tuple[int, Any]] = field(default_factory=list)
    bodies: dict[int, str] = field(default_factory=dict)
    sites: dict[int, str] = field(default_factory=dict)
    qpos: list[int] = field(default_factory=list)
    dofs: list[int] = field(default_factory=list)

    def pairs(self) -> Iterator[tuple[int, Any]]:
        """Yield each joint that moves: its index in MuJoCo, and the joint of pinocchio."""
        for j, here in self.joints.items():
            yield j, self.model.joints[here]


def build(part: Part) -> Built:
    """Build the model: joints, inertias, armature, gravity and frames, but no limits."""
    mj = part.compiled.model
    built = Built(part, empty(part.compiled.file, "floating" if part.on_base else "fixed"))
    weight = 0.0 if disabled(mj, "gravity") else 1.0
    built.model.gravity.linear = weight * np.array(mj.opt.gravity)
    built.placed.append((built.model.njoints - 1, pin.SE3.Identity()))
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
        places = part.compiled.places(j)
        if kind == "free":  # its position is that of the body in the world
            at = place = pin.SE3.Identity()
        if j in part.joints:
            along = kind in ("slide", "hinge")
            reference = _motion(kind, axis, -mj.qpos0[places]) if along else pin.SE3.Identity()
            joint = _MODELS[kind](*([axis] if along else []))
            parent = built.joints[j] = add_joint(
                built.model, parent, joint, place * at * reference, part.compiled.joints[j])
            place = at.inverse()
            built.qpos.extend(places)
            built.dofs.extend(mj.jnt_dofadr[j] + np.arange(joint.nv))
        else:
            q = part.held[places] - mj.qpos0[places] * (len(places) == 1)
            place = place * at * _motion(kind, axis, q) * at.inverse()
    built.placed.append((parent, place))


_MODELS = {"slide": pin.JointModelPrismaticUnaligned, "hinge": pin.JointModelRevoluteUnaligned,
           "free": pin.JointModelFreeFlyer, "ball": pin.JointModelSpherical}


def _motion(kind: str, axis: Array, q: Array) -> Any:
    """Return how a joint at q, in our order, moves its body."""
    if len(q) > 1:
        return pose(q[:3] if kind == "free" else np.zeros(3), np.roll(q[-4:], 1))
    if kind == "slide":
        return pin.SE3(np.eye(3), axis * q[0])
    return pin.SE3(pin.AngleAxis(float(q[0]), axis).toRotationMatrix(), np.zeros(3))


def pose(position: Array, quaternion: Array) -> Any:
    """Return a placement with a quaternion w, x, y, z of MuJoCo."""
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return pin.SE3(pin.Quaternion(w, x, y, z).toRotationMatrix(), np.array(position))


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
        inertia[mj.jnt_dofadr[j]] += gear**2 * mj.actuator_armature[i]
    base = np.zeros(built.model.nv - len(built.dofs))
    built.model.armature = np.concatenate([base, inertia[built.dofs]])


def joint_actuators(mj: Any) -> Iterator[tuple[int, int, float]]:
    """Yield the index, the joint and the gear of each actuator that moves one hinge or slide."""
    for i in range(mj.nactuator):
        j = int(mj.actuator_trnid[i, 0])
        if mj.actuator_trntype[i] in _ON_JOINT and mj.jnt_type[j] in _SCALAR:
            yield i, j, float(mj.actuator_gear[mj.actuator_outadr[i], 0])


_ON_JOINT = (0, 1)  # mjTRN_JOINT, mjTRN_JOINTINPARENT
_SCALAR = (2, 3)    # mjJNT_SLIDE, mjJNT_HINGE


def configuration(built: Built, qpos: Array) -> Array:
    """Return q (nq,) for a qpos (nq,) of MuJoCo, its quaternions made unit length."""
    base = pin.neutral(built.model)[:built.model.nq - len(built.qpos)]
    return np.asarray(pin.normalize(built.model, np.concatenate([base, qpos[built.qpos]])))


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
    index = {frame.name: i for i, frame in enumerate(model.frames)}
    for step in (np.zeros(model.nv), *steps):
        q = np.asarray(pin.integrate(model, configuration(built, mj.qpos0), step))
        data.qpos[:] = built.part.held
        data.qpos[built.qpos] = q[model.nq - len(built.qpos):]
        for stage in ("mj_kinematics", "mj_comPos", "mj_tendon", "mj_transmission", "mj_makeM"):
            getattr(mujoco, stage)(mj, data)
        pin.framesForwardKinematics(model, own, q)
        for what, found, position, rotation in (
                *((f"body {name!r}", own.oMf[index[name]], data.xpos[i], data.xmat[i])
                  for i, name in built.bodies.items()),
                *((f"site {name!r}", own.oMf[index[name]], data.site_xpos[i], data.site_xmat[i])
                  for i, name in built.sites.items())):
            off = np.abs([*(found.translation - position), *(found.rotation.ravel() - rotation)]
                         ).max()
            if not off <= _SAME * max(1.0, np.abs(position).max()):
                raise file.error(f"{what} is {off:.2g} from where MuJoCo has it")
        _compare_inertia(built, q, pin.crba(model, own, q), data, mujoco.mj_mulM)


def _compare_inertia(built: Built, q: Array, M: Array, data: Any, times: Any) -> None:
    """Compare the rows and columns of the joints that both have."""
    file, nv = built.part.compiled, built.model.nv
    columns = np.zeros((nv, file.model.nv))
    columns[np.arange(nv - len(built.dofs), nv), built.dofs] = 1.0
    if 0 < len(built.dofs) == nv and file.kind(next(iter(built.joints))) == "free":
        # Only the first joint can be free; its linear velocity is in the body's frame here.
        columns[:3, built.dofs[:3]] = pin.Quaternion(q[3:7]).toRotationMatrix().T
    products = np.zeros_like(columns)
    for row, product in zip(columns, products, strict=True):
        times(file.model, data, product, row)
    both = columns.any(axis=1)
    off = np.abs(np.triu(M - products @ columns.T)[np.ix_(both, both)])
    own = np.sqrt(np.diag(M)[both])
    allowed = _SAME * np.outer(own, own) + _ROUNDING * np.abs(M).max(initial=0.0)
    for row, column in np.argwhere(~(off <= allowed)):
        dof = np.flatnonzero(columns[both][column])[0]
        raise file.error(f"the inertia at body {file.bodies[file.model.dof_bodyid[dof]]!r} is "
                         f"{off[row, column]:.2g} from what MuJoCo has")
