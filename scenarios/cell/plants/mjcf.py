"""An arm and its obstacles as a MuJoCo scene in the format MJCF."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from hierarchy import Robot
from hierarchy.avoidance import Capsule, Obstacle
from hierarchy.problem import Array
from hierarchy.robot import Body
from scenarios.config import ScenarioError
from scenarios.config.kinds.mujoco import JointsSection, ServoSection

GRAVITY = 9.81     # [m/s^2], along -z of the world, as in the robot's own model
_SOFTNESS = 0.02   # [s] time constant of a contact: a few mm of penetration at usual speeds
_FRICTION = "0.5 0.005 0.0001"  # of a contact: sliding, turning [m], rolling [m]
Element = ElementTree.Element


def scene(robot: Robot, capsules: Sequence[Capsule], obstacles: Sequence[Obstacle],
          joints: JointsSection, servo: ServoSection, gains: tuple[Array, Array],
          timestep: float) -> str:
    """Return the scene: bodies of the robot, capsules, servos, and movable obstacles.

    gains : stiffness (n,) [N m/rad] and damping (n,) [N m s/rad] of the servos. Actuators are the
    n joint positions, then the n joint velocities. Obstacles are bodies "obstacle 1" and so on;
    points have no body. Raises ScenarioError unless all joints turn about their frames' z axes.
    """
    root = Element("mujoco", model=robot.name)
    ElementTree.SubElement(root, "compiler", angle="radian", inertiafromgeom="false")
    option = ElementTree.SubElement(root, "option", timestep=repr(timestep),
                                    gravity=f"0 0 {-GRAVITY}", integrator="implicitfast")
    ElementTree.SubElement(option, "flag", autoreset="disable")  # a diverged state is not reset
    default = ElementTree.SubElement(root, "default")
    ElementTree.SubElement(default, "geom", solref=text(_SOFTNESS, 1.0), friction=_FRICTION)
    world = ElementTree.SubElement(root, "worldbody")
    _arm(world, robot, capsules, joints, servo)
    _obstacles(world, obstacles)
    _servos(root, robot, gains)
    return ElementTree.tostring(root, encoding="unicode")


def each(value: float | tuple[float, ...], n: int, name: str) -> Array:
    """Return a setting (n,) that is given as one value for all joints or one each."""
    values = np.full(n, value) if isinstance(value, float | int) else np.array(value)
    if len(values) != n:
        raise ScenarioError(f"{name} has {len(values)} entries, the robot has {n} joints")
    return values


def _arm(world: Element, robot: Robot, capsules: Sequence[Capsule], joints: JointsSection,
         servo: ServoSection) -> None:
    n, elements = robot.n, [world]
    friction, damping, armature = (
        each(getattr(joints, key), n, f"plant.joints.{key}")
        for key in ("friction", "damping", "armature"))
    for i, body in enumerate(robot.bodies()):
        element = _body(elements[body.parent], body, servo.gravity)
        elements.append(element)
        joint = ElementTree.SubElement(
            element, "joint", name=body.name, type="hinge", axis="0 0 1",
            frictionloss=text(friction[i]), damping=text(damping[i]),
            armature=text(armature[i]), actuatorgravcomp="true")
        if np.isfinite([robot.lower[i], robot.upper[i]]).all():
            joint.set("limited", "true")
            joint.set("range", text(robot.lower[i], robot.upper[i]))
        if np.isfinite(robot.effort_limit[i]):
            joint.set("actuatorfrclimited", "true")
            joint.set("actuatorfrcrange", text(-robot.effort_limit[i], robot.effort_limit[i]))
    for capsule in capsules:
        ElementTree.SubElement(
            elements[capsule.joint], "geom", name=capsule.name, type="capsule",
            fromto=text(*capsule.start, *capsule.end), size=text(capsule.radius),
            contype="1", conaffinity="0")


def _body(parent: Element, body: Body, gravity: float) -> Element:
    element = ElementTree.SubElement(parent, "body", name=f"body {body.name}",
                                     pos=text(*body.position),
                                     xyaxes=text(*body.rotation[:, 0], *body.rotation[:, 1]),
                                     gravcomp=text(gravity))
    I = body.inertia  # noqa: E741
    ElementTree.SubElement(
        element, "inertial", mass=text(body.mass), pos=text(*body.centre),
        fullinertia=text(I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]))
    return element


def _obstacles(world: Element, obstacles: Sequence[Obstacle]) -> None:
    """Add the obstacles: they collide with the arm, not with each other."""
    for number, obstacle in enumerate(obstacles, 1):
        if obstacle.shape == "point":
            continue
        axes = np.asarray(obstacle.rotation, dtype=float)
        element = ElementTree.SubElement(
            world, "body", name=f"obstacle {number}", mocap="true",
            pos=text(*obstacle.centre), xyaxes=text(*axes[:, 0], *axes[:, 1]))
        ElementTree.SubElement(element, "geom", type=obstacle.shape, size=text(*obstacle.size),
                               contype="0", conaffinity="1")


def _servos(root: Element, robot: Robot, gains: tuple[Array, Array]) -> None:
    actuator = ElementTree.SubElement(root, "actuator")
    for kind, key, values in (("position", "kp", gains[0]), ("velocity", "kv", gains[1])):
        for name, gain in zip(robot.joint_names, values, strict=True):
            ElementTree.SubElement(actuator, kind, {"joint": name, key: text(gain)})


def text(*numbers: ArrayLike) -> str:
    """Return numbers as an attribute of MJCF."""
    return " ".join(repr(float(number)) for number in np.array(numbers, dtype=float))
