"""Robots and their surroundings as MuJoCo scenes in the format MJCF; here an arm under servos."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from hierarchy import Robot
from hierarchy.avoidance import Obstacle
from hierarchy.problem import Array
from hierarchy.robot import Body
from scenarios.config import ScenarioError
from scenarios.config.plant import JointsSection, ServoSection

_GRAVITY = (0.0, 0.0, -9.81)  # [m/s^2] in the world, as in the robot's own model
_SOFTNESS = 0.02   # [s] time constant of a contact: a few mm of penetration at usual speeds
_FRICTION = (0.5, 0.005, 0.0001)  # of a contact: sliding, turning [m], rolling [m]
Element = ElementTree.Element


def add(parent: Element, tag: str, **values: ArrayLike) -> Element:
    """Add an element whose attributes are texts or numbers, written exactly."""
    return ElementTree.SubElement(parent, tag, {
        key: value if isinstance(value, str) else
        " ".join(repr(float(number)) for number in np.ravel(np.asarray(value, dtype=float)))
        for key, value in values.items()})


def begin(robot: Robot, timestep: float, **option: ArrayLike) -> tuple[Element, Element]:
    """Return the root of a scene and its world."""
    root = Element("mujoco", model=robot.name)
    add(root, "compiler", angle="radian", inertiafromgeom="false")
    about = add(root, "option", timestep=timestep, gravity=_GRAVITY, **option)
    add(about, "flag", autoreset="disable")  # a diverged state is not reset
    return root, add(root, "worldbody")


def add_body(parent: Element, body: Body, least: tuple[float, float] = (0.0, 0.0),
             **values: ArrayLike) -> Element:
    """Add a body "body NAME", with at least a mass [kg] and moments of inertia [kg m^2] more."""
    I = body.inertia + least[1] * np.eye(3)  # noqa: E741
    element = add(parent, "body", name=f"body {body.name}", pos=body.position,
                  xyaxes=axes(body.rotation), **values)
    add(element, "inertial", mass=max(body.mass, least[0]), pos=body.centre,
        fullinertia=I[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    return element


def axes(rotation: ArrayLike) -> Array:
    """Return the x and y axes (6,) of a rotation (3, 3), as MJCF has them."""
    return np.asarray(rotation, dtype=float)[:, :2].T.ravel()


def scene(robot: Robot, obstacles: Sequence[Obstacle], joints: JointsSection, servo: ServoSection,
          gains: tuple[Array, Array], timestep: float) -> str:
    """Return the scene: bodies of the robot, its capsules, servos, and movable obstacles.

    gains : stiffness (n,) [N m/rad] and damping (n,) [N m s/rad] of the servos. Actuators are the
    n joint positions, then the n joint velocities. Obstacles are bodies "obstacle 1" and so on;
    points have no body. Raises ScenarioError unless all joints turn about their frames' z axes.
    """
    root, world = begin(robot, timestep, integrator="implicitfast")
    add(add(root, "default"), "geom", solref=(_SOFTNESS, 1.0), friction=_FRICTION)
    _arm(world, robot, joints, servo)
    _obstacles(world, obstacles)
    actuator = add(root, "actuator")
    for kind, key, values in (("position", "kp", gains[0]), ("velocity", "kv", gains[1])):
        for name, gain in zip(robot.joint_names, values, strict=True):
            add(actuator, kind, joint=name, **{key: gain})
    return ElementTree.tostring(root, encoding="unicode")


def each(value: float | tuple[float, ...], n: int, name: str) -> Array:
    """Return a setting (n,) that is given as one value for all joints or one each."""
    values = np.full(n, value) if isinstance(value, float | int) else np.array(value)
    if len(values) != n:
        raise ScenarioError(f"{name} has {len(values)} entries, the robot has {n} joints")
    return values


def _arm(world: Element, robot: Robot, joints: JointsSection, servo: ServoSection) -> None:
    elements = [world]
    friction, damping, armature = (
        each(getattr(joints, key), robot.n, f"plant.joints.{key}")
        for key in ("friction", "damping", "armature"))
    for i, body in enumerate(robot.bodies()):
        elements.append(add_body(elements[body.parent], body, gravcomp=servo.gravity))
        range_, effort = (robot.lower[i], robot.upper[i]), robot.effort_limit[i]
        limits = {"limited": "true", "range": range_} if np.isfinite(range_).all() else {}
        efforts = {"actuatorfrclimited": "true", "actuatorfrcrange": (-effort, effort)
                   } if np.isfinite(effort) else {}
        add(elements[-1], "joint", name=body.name, type="hinge", axis=(0, 0, 1),
            frictionloss=friction[i], damping=damping[i], armature=armature[i],
            actuatorgravcomp="true", **limits, **efforts)
    for capsule in robot.capsules:
        add(elements[capsule.joint], "geom", name=capsule.name, type="capsule",
            fromto=(*capsule.start, *capsule.end), size=capsule.radius, contype="1",
            conaffinity="0")


def _obstacles(world: Element, obstacles: Sequence[Obstacle]) -> None:
    """Add the obstacles: they collide with the arm, not with each other."""
    for number, obstacle in enumerate(obstacles, 1):
        if obstacle.shape != "point":
            body = add(world, "body", name=f"obstacle {number}", mocap="true",
                       pos=obstacle.centre, xyaxes=axes(obstacle.rotation))
            add(body, "geom", type=obstacle.shape, size=obstacle.size, contype="0",
                conaffinity="1")


@final
class Stops:
    """The position limits of a robot's joints.

    A joint that is more than `beyond` [rad or m] past one has gone through its stop. Where a joint
    starts beyond a limit, at q (nq,), its stop is there.
    """

    def __init__(self, robot: Robot, q: Array, beyond: float) -> None:
        self._names, self._units = robot.velocity_names, robot.velocity_units
        self._of, self._beyond = robot.coordinates, beyond
        self._lower = np.minimum(robot.lower, q)[self._of]
        self._upper = np.maximum(robot.upper, q)[self._of]

    def passed(self, q: Array) -> str | None:
        """Return which joint at q (nq,) is farthest beyond its stop, None if none is too far."""
        here = q[self._of]
        over = np.maximum(self._lower - here, here - self._upper)
        i = int(over.argmax())
        if not over[i] > self._beyond:
            return None
        stop, unit = self._upper[i] if here[i] > self._upper[i] else self._lower[i], self._units[i]
        return (f"joint {self._names[i]} is {over[i]:.2g} {unit} beyond its stop at {stop:.4g} "
                f"{unit} (plant.beyond_stop = {self._beyond:g}),")
