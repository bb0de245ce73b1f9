"""frax: kinematics in jax, compiled; its differential inverse kinematics is a few lines around it.

As in its demonstration: pseudoinverse of the position's Jacobian, posture in its null space, and
velocities clipped to their limits at the end. Its settings for a single core are those it advises.
"""

import os
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

os.environ.update(JAX_ENABLE_X64="1", JAX_PLATFORMS="cpu",
                  XLA_FLAGS="--xla_cpu_multi_thread_eigen=false")

import jax
import jax.numpy as jnp
import numpy as np
from frax import Manipulator

from benchmark.peers.scenes import Arm, Array

_NONE = {**dict.fromkeys(("ixx", "iyy", "izz"), "1e-9"),
         **dict.fromkeys(("ixy", "ixz", "iyz"), "0")}


def arm(scene: Arm, posture: bool) -> tuple[Any, None]:
    """One compiled function of joints, goal and rate."""
    robot = Manipulator(str(_with_inertias(Path(scene.file))),
                        ee_offset=_offset(Path(scene.file), scene.frame))
    limit, still = jnp.array(scene.limit), jnp.array(scene.posture)
    share = scene.posture_gain if posture else 0.0

    @jax.jit  # type: ignore[untyped-decorator]
    def compiled(q: Any, goal: Any, rate: Any) -> Any:
        J, T = robot.velocity_control_matrices(q)
        J = J[:3]
        inverse = J.T @ jnp.linalg.inv(J @ J.T)
        own = share * (still - q)
        v = inverse @ (rate + scene.gain * (goal - T[:3, 3])) + own - inverse @ (J @ own)
        return jnp.clip(v, -limit, limit)

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        return np.asarray(compiled(q, goal, rate))

    return velocity, None


def _with_inertias(file: Path) -> Path:
    """Write a copy in which every link has an inertia, which it demands, and return its path."""
    tree = ET.parse(file)
    for link in tree.iter("link"):
        if link.find("inertial") is None:
            inertial = ET.SubElement(link, "inertial")
            ET.SubElement(inertial, "origin", xyz="0 0 0", rpy="0 0 0")
            ET.SubElement(inertial, "mass", value="1e-9")
            ET.SubElement(inertial, "inertia", _NONE)
    copy = file.with_name(f"{file.stem}-{os.getpid()}.urdf")
    tree.write(copy)
    return copy


def _offset(file: Path, frame: str) -> Array:
    """Return the pose (4, 4) of the frame in the last joint's link, to which it is fixed."""
    joint = next(one for one in ET.parse(file).iter("joint")
                 if one.find("child").attrib["link"] == frame)  # type: ignore[union-attr]
    origin, pose = joint.find("origin"), np.eye(4)
    pose[:3, 3] = [float(part) for part in origin.attrib["xyz"].split()]  # type: ignore[union-attr]
    return pose
