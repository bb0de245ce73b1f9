"""The pinocchio model of a URDF, with what pinocchio leaves out: bases and planes."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from hierarchy.errors import RobotError
from hierarchy.robots.found import is_floating
from hierarchy.robots.from_table import ROOT
from hierarchy.robots.table import Base

Element = ElementTree.Element


def model_of(root: Element, base: Base | None) -> Any:
    """Build the model of a URDF, whose planar joints move in the plane normal to their axis.

    A floating first joint is the free base; `base` "fixed" fixes it where the file has it, and
    "floating" adds one to a URDF without.
    """
    text = ElementTree.tostring(root, encoding="unicode")
    model = pin.buildModelFromXML(text)
    if base == "floating" and not is_floating(model):
        if ROOT in list(model.names):
            raise RobotError(f"joint {ROOT!r} has the name that a floating base is given")
        model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    elif base == "fixed" and is_floating(model):
        model = pin.buildReducedModel(model, [1], pin.neutral(model))
    for joint in root.findall("joint"):
        if joint.get("type") == "planar" and joint.get("name") in list(model.names):
            axis = joint.find("axis")
            xyz = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
            _turn(model, model.getJointId(joint.get("name")), np.array(xyz.split(), dtype=float))
    return model


def _turn(model: Any, joint: int, axis: Any) -> None:
    """Turn z of a joint onto `axis` (3,), and leave in place what it carries."""
    z = np.array([0.0, 0.0, 1.0])
    turn = pin.SE3(pin.Quaternion.FromTwoVectors(z, axis), np.zeros(3))
    back = turn.inverse()
    model.jointPlacements[joint] = model.jointPlacements[joint] * turn
    model.inertias[joint] = back.act(model.inertias[joint])
    for child in range(1, model.njoints):
        if model.parents[child] == joint:
            model.jointPlacements[child] = back * model.jointPlacements[child]
    for frame in model.frames:
        if frame.parentJoint == joint:
            frame.placement = back * frame.placement
