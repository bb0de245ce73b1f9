"""What a robot leaves out of its MJCF."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hierarchy.robots.mjcf.compiled import Compiled, name_of
from hierarchy.robots.mjcf.model import armature, joint_actuators
from hierarchy.robots.mjcf.part import Part
from hierarchy.words import listed, some


def left_out(part: Part) -> Iterator[str]:
    """Yield a sentence for each thing that the file has and the robot lacks."""
    mj = part.compiled.model
    for kind, count, said in (
            ("tendon", mj.ntendon, "of tendons only couplings of joints are here"),
            ("flex", mj.nflex, "of flexes only the joints are here"),
            ("skin", mj.nskin, "skins are left out")):
        if count:
            yield f"{said}: {some([name_of(mj, kind, i) for i in range(count)])}"
    if mj.nplugin:
        yield f"plugins of MuJoCo do nothing here: {mj.nplugin}"
    if (floating := np.flatnonzero(mj.body_gravcomp)).size:
        yield ("compensation of gravity is left out: "
               + some([part.compiled.bodies[body] for body in floating]))
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
