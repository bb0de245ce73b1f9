"""The model of pinocchio against MuJoCo: kinematics and mass matrix, in three configurations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from hierarchy.problem import Array
from hierarchy.robots.library import pin
from hierarchy.robots.mjcf.model import Built, configuration, to_mujoco

_SAME = 1e-9       # relative to the robot's size, and to the inertias of the two joints of an entry
_ROUNDING = 1e-13  # of M, relative to its largest entry
_SAMPLES = 2       # besides the reference configuration
_REACH = 1.0       # [rad or m] from it


def compare(built: Built) -> None:
    """Raise RobotError, naming the body, where a model differs from MuJoCo's by more than 1e-9."""
    import mujoco

    file, model = built.part.compiled, built.model
    mj, data, own = file.model, mujoco.MjData(file.model), model.createData()
    for q in _configurations(built):
        data.qpos[:] = to_mujoco(built, q)
        for step in ("mj_kinematics", "mj_comPos", "mj_tendon", "mj_transmission", "mj_makeM"):
            getattr(mujoco, step)(mj, data)
        pin.framesForwardKinematics(model, own, q)
        for what, found, expected in (
                *_frames(built, own, "body", built.bodies, data.xpos, data.xmat),
                *_frames(built, own, "site", built.sites, data.site_xpos, data.site_xmat)):
            off = np.abs(found - expected).max()
            if not off <= _SAME * max(1.0, np.abs(expected).max()):
                raise file.error(f"{what} is {off:.2g} from where MuJoCo has it")
        _compare_inertia(built, q, pin.crba(model, own, q), data, mujoco.mj_mulM)


def _configurations(built: Built) -> Iterator[Array]:
    """Yield the reference configuration, and others around it."""
    q = configuration(built, built.part.compiled.model.qpos0)
    yield q
    generator = np.random.default_rng(0)
    for _ in range(_SAMPLES):
        step = generator.uniform(-_REACH, _REACH, built.model.nv)
        if built.part.on_base:  # which MuJoCo has not
            step[:6] = 0.0
        yield np.asarray(pin.integrate(built.model, q, step))


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
    allowed = _SAME * np.outer(own, own) + _ROUNDING * np.abs(M).max()
    for row, column in np.argwhere(~(off <= allowed)):
        v = np.flatnonzero(both)[column]
        j = next(j for j, joint in built.pairs() if joint.idx_v <= v < joint.idx_v + joint.nv)
        raise file.error(f"the inertia at body {file.bodies[file.model.jnt_bodyid[j]]!r} is "
                         f"{off[row, column]:.2g} from what MuJoCo has")
