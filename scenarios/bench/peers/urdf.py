"""A robot of ours as a URDF file, so that every package reads the same arm."""

from __future__ import annotations

import warnings
import xml.etree.ElementTree as ET

import numpy as np
from scipy.spatial.transform import Rotation

from hierarchy.errors import RobotError
from hierarchy.problem import Array
from hierarchy.robot import Body, Robot
from hierarchy.robots import TABLES

_FUSED = {"fusestatic": "false"}  # else MuJoCo drops the end effector's link


def urdf(robot: Robot) -> str:
    """Return the text of a URDF of the robot: joints, limits, inertias and its end effector.

    The link that a joint moves is called "link of" and the joint's name; the end effector is a
    link without mass. RobotError unless the robot was made from a table: all of its joints
    revolute, about their z axes.
    """
    if robot.name not in TABLES or robot.nq != robot.n:
        raise RobotError(f"robot {robot.name!r} was not made from a table; its file is its URDF")
    root = ET.Element("robot", name=robot.name)
    ET.SubElement(ET.SubElement(root, "mujoco"), "compiler", _FUSED)
    links = ["base", *(f"link of {name}" for name in robot.joint_names)]
    ET.SubElement(root, "link", name=links[0])
    for i, body in enumerate(robot.bodies()):
        _add_link(root, links[i + 1], body)
        joint = _add_joint(root, body.name, "revolute", links[body.parent], links[i + 1],
                           body.position, body.rotation)
        ET.SubElement(joint, "axis", xyz="0 0 1")
        ET.SubElement(joint, "limit", lower=repr(float(robot.lower[i])),
                      upper=repr(float(robot.upper[i])),
                      velocity=repr(float(robot.velocity_limit[i])),
                      effort=repr(float(robot.effort_limit[i])))
    end = robot.frame(robot.end_effector)
    ET.SubElement(root, "link", name=end.name)
    _add_joint(root, f"to {end.name}", "fixed", links[end.joint], end.name, end.offset,
               end.rotation)
    ET.indent(root)
    return '<?xml version="1.0"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def roll_pitch_yaw(R: Array) -> Array:
    """Return the angles (3,) [rad] with R = Rz(yaw) Ry(pitch) Rx(roll), as URDF has them."""
    with warnings.catch_warnings():  # of a pitch of 90 deg, where yaw is arbitrary and set to 0
        warnings.simplefilter("ignore", UserWarning)
        return np.asarray(Rotation.from_matrix(R).as_euler("xyz"))


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
    ET.SubElement(joint, "origin", xyz=_numbers(position), rpy=_numbers(roll_pitch_yaw(rotation)))
    ET.SubElement(joint, "parent", link=parent)
    ET.SubElement(joint, "child", link=child)
    return joint


def _numbers(values: Array) -> str:
    return " ".join(repr(float(value)) for value in values)
