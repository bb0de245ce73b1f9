"""A robot of ours as a URDF file, so that every package reads the same robot."""

import xml.etree.ElementTree as ET
from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from hierarchy.errors import RobotError
from hierarchy.problem import Array
from hierarchy.robot import Body, Frame, Robot
from hierarchy.robots import TABLES
from hierarchy.robots.table import TreeTable

_AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}
_FUSED = {"fusestatic": "false"}  # else MuJoCo drops the end effector's link


def urdf(robot: Robot, frames: Sequence[Frame] | None = None) -> str:
    """Return the text of a URDF of the robot: joints, limits, inertias and some of its frames.

    The link that a joint moves is called "link of" and the joint's name; each of `frames`, the end
    effector if None, is a link without mass. The first link of a robot on a floating base is that
    base. RobotError unless the robot was made from a table.
    """
    floating = robot.base == "floating"
    if robot.name not in TABLES or robot.nq != robot.n + floating:
        raise RobotError(f"robot {robot.name!r} was not made from a table; its file is its URDF")
    root = ET.Element("robot", name=robot.name)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", _FUSED)
    table = TABLES[robot.name]
    axes = [joint.axis for joint in table.joints] if isinstance(table, TreeTable) else (
        ["z"] * len(robot.joint_names))
    bodies, links = robot.bodies(), ["base", *(f"link of {name}" for name in robot.joint_names)]
    if floating:
        _add_link(root, links[1], bodies[0])
    else:
        ET.SubElement(root, "link", name=links[0])
    for i in range(int(floating), len(bodies)):
        _add_link(root, links[i + 1], bodies[i])
        joint = _add_joint(root, bodies[i].name, "revolute", links[bodies[i].parent], links[i + 1],
                           bodies[i].position, bodies[i].rotation)
        ET.SubElement(joint, "axis", xyz=_AXES[axes[i - floating]])
        q, v = robot.model.joints[i + 1].idx_q, robot.model.joints[i + 1].idx_v
        ET.SubElement(joint, "limit", lower=repr(float(robot.lower[q])),
                      upper=repr(float(robot.upper[q])),
                      velocity=repr(float(robot.velocity_limit[v])),
                      effort=repr(float(robot.effort_limit[v])))
    for frame in [robot.frame(robot.end_effector)] if frames is None else frames:
        ET.SubElement(root, "link", name=frame.name)
        _add_joint(root, f"to {frame.name}", "fixed", links[frame.joint], frame.name,
                   frame.offset, frame.rotation)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _add_link(root: ET.Element, name: str, body: Body) -> None:
    inertial = ET.SubElement(ET.SubElement(root, "link", name=name), "inertial")
    ET.SubElement(inertial, "origin", xyz=_numbers(body.centre), rpy="0 0 0")
    ET.SubElement(inertial, "mass", value=repr(body.mass))
    rows = zip("xxxyyz", "xyzyzz", np.triu_indices(3)[0], np.triu_indices(3)[1], strict=True)
    ET.SubElement(inertial, "inertia",
                  {f"i{a}{b}": repr(float(body.inertia[i, j])) for a, b, i, j in rows})


def _add_joint(root: ET.Element, name: str, kind: str, parent: str, child: str, position: Array,
               rotation: Array) -> ET.Element:
    joint = ET.SubElement(root, "joint", name=name, type=kind)
    ET.SubElement(joint, "origin", xyz=_numbers(position),
                  rpy=_numbers(pin.rpy.matrixToRpy(rotation)))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    return joint


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
