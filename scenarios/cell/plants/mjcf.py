"""Robots and their surroundings as MuJoCo scenes in the format MJCF.

An arm under servos among obstacles, or a robot on a floor: torque motors, soles, friction.
"""

from collections.abc import Sequence
from typing import Any, final
from xml.etree import ElementTree

import numpy as np
from numpy.typing import ArrayLike

from hierarchy import Robot, State
from hierarchy.avoidance import Capsule, Obstacle
from hierarchy.avoidance.body import measure_capsules, pack_capsules, pairs_of_tree
from hierarchy.contacts import Contact, Contacts
from hierarchy.problem import Array
from scenarios.config import ScenarioError
from scenarios.config.sections.plant import JointsSection, ServoSection, TorqueSection

_SOFTNESS = 0.02   # [s] time constant of a contact: a few mm of penetration at usual speeds
_FRICTION = (0.5, 0.005, 0.0001)  # of a contact: sliding, turning [m], rolling [m]
LEAST = 1e-6, 1e-9  # [kg], [kg m^2] of a body that only joins two joints
_SKIN = 0.3             # friction of a link on another
# Of a joint's effort limit, as gears and motors grow with it; plausible, not identified.
_DRIVE = {"joint_friction": 0.005, "joint_damping": 0.002, "armature": 0.0001}
_FAR = 1e9           # [rad or m] where the stop of a joint without one is
_THICKNESS = 0.01    # [m] half of that of a sole
_SLIDING = 0.15      # [s] time constant of the friction of what slides
BALL = 0.001         # [m] radius of a point that touches
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
    add(root, "compiler", angle="radian", inertiafromgeom="false", balanceinertia="true")
    about = add(root, "option", timestep=timestep, gravity=robot.model.gravity.linear, **option)
    add(about, "flag", autoreset="disable")  # a diverged state is not reset
    return root, add(root, "worldbody")


def axes(rotation: ArrayLike) -> Array:
    """Return the x and y axes (6,) of a rotation (3, 3), as MJCF has them."""
    return np.asarray(rotation, dtype=float)[:, :2].T.ravel()


def scene(robot: Robot, q: Array, obstacles: Sequence[Obstacle], joints: JointsSection,
          servo: ServoSection, gains: tuple[Array, Array], timestep: float) -> str:
    """Return the scene of a robot at q (nq,): its bodies, capsules, servos; movable obstacles.

    gains : stiffness (n,) [N m/rad] and damping (n,) [N m s/rad] of the servos. Actuators are the
    n joint positions, then the n joint velocities. Obstacles are bodies "obstacle 1" and so on;
    points have no body. Raises ScenarioError unless all joints turn about their frames' z axes.
    """
    root, world = begin(robot, timestep, integrator="implicitfast")
    add(add(root, "default"), "geom", solref=(_SOFTNESS, 1.0), friction=_FRICTION)
    friction, damping, armature = (
        each(getattr(joints, key), robot.n, f"plant.joints.{key}")
        for key in ("friction", "damping", "armature"))
    drives = [{"frictionloss": friction[i], "damping": damping[i], "armature": armature[i],
               "actuatorgravcomp": "true"} | stop for i, stop in enumerate(_stops(robot, q))]
    for drive, effort in zip(drives, robot.effort_limit, strict=True):
        if np.isfinite(effort):
            drive |= {"actuatorfrclimited": "true", "actuatorfrcrange": (-effort, effort)}
    elements = _bodies(world, robot, drives, gravcomp=servo.gravity)
    for capsule in robot.capsules:
        add(elements[capsule.joint], "geom", name=capsule.name, **_link(capsule),
            contype="1", conaffinity="0")
    for number, obstacle in enumerate(obstacles, 1):  # which do not collide with each other
        if obstacle.shape != "point":
            body = add(world, "body", name=f"obstacle {number}", mocap="true",
                       pos=obstacle.centre, xyaxes=axes(obstacle.rotation))
            add(body, "geom", type=obstacle.shape, size=obstacle.size, contype="0",
                conaffinity="1")
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


def _stops(robot: Robot, q: Array) -> list[dict[str, ArrayLike]]:
    """Return the limits of each velocity (n); where q (nq,) is beyond one, its stop is there."""
    (lower, upper), at = robot.position_limits(), robot.vector(q)
    lower, upper = np.minimum(lower, at), np.maximum(upper, at)
    # MuJoCo takes no range of one value, as of a joint whose file gives it no room, nor subnormals.
    least = np.maximum(np.nextafter(lower, np.inf), lower + 1e-300)
    ranges = np.array([lower, np.maximum(upper, least)]).T
    return [{"limited": "true", "range": np.nan_to_num(range_, posinf=_FAR, neginf=-_FAR)}
            if np.isfinite(range_).any() else {} for range_ in ranges]


def _link(capsule: Capsule) -> dict[str, Any]:
    """Return the shape of a link: a ball if it has no length."""
    if capsule.start == capsule.end:
        return {"type": "sphere", "pos": capsule.start, "size": capsule.radius}
    return {"type": "capsule", "fromto": (*capsule.start, *capsule.end), "size": capsule.radius}


def on_floor(robot: Robot, contacts: Contacts, floor: TorqueSection, timestep: float, q: Array
             ) -> str:
    """Return the scene of a robot at q (nq,) whose `contacts` touch a horizontal floor.

    A sole is a box in the place of its corners, a point a small ball; nothing else touches
    anything, except capsules with `floor.self_collision`. Bodies are named "body JOINT", geometries
    "contact CONTACT". Actuators are the torques of the actuated joints. What the robot couples or
    closes are equalities. Raises ScenarioError unless each joint, but for that of a floating base,
    turns about or slides along one axis.
    """
    root, world = begin(robot, timestep, cone="elliptic", integrator="Euler", tolerance=1e-12,
                        iterations="200")
    add(world, "geom", type="plane", name="the floor", size=(20, 20, 1), pos=(0, 0, floor.height))
    friction, damping, armature = (of_drives(robot, key, getattr(floor, key)) for key in _DRIVE)
    stops = _stops(robot, q) if floor.stops else [{}] * robot.n
    drives = [{"damping": damping[v], "armature": robot.model.armature[v] + armature[v],
               "frictionloss": friction[v]} | stop for v, stop in enumerate(stops)]
    elements, pairs = _bodies(world, robot, drives, LEAST), add(root, "contact")
    for contact in contacts.contacts:
        touching = f"contact {contact.name}"
        add(elements[contact.frame.joint], "geom", name=touching, contype="0",
            conaffinity="0", **_shape(contact))
        # MuJoCo raises the normal force of a sliding contact with the friction that it would take
        # to stop it at once; that of one that is to slide is softer, and the hand does not hop.
        along = _SLIDING if contact.slides else floor.softness
        add(pairs, "pair", geom1="the floor", geom2=touching, condim="3",
            friction=(floor.friction, floor.friction, 0, 0, 0), solref=(floor.softness, 1.0),
            solreffriction=(along, 1.0))
    if floor.self_collision:
        _capsules(elements, pairs, robot, q)
    _equalities(root, robot, elements, timestep)
    actuator = add(root, "actuator")
    for name, limit in zip(robot.velocity_names[robot.actuated:],
                           robot.effort_limit[robot.actuated:], strict=True):
        limits = {"ctrllimited": "true", "ctrlrange": (-limit, limit)} if np.isfinite(limit) else {}
        add(actuator, "motor", joint=name, **limits)
    return ElementTree.tostring(root, encoding="unicode")


def _capsules(elements: list[Element], contact: Element, robot: Robot, q: Array) -> None:
    """Add the capsules of a robot at q (nq,), and the pairs that may touch later."""
    for capsule in robot.capsules:
        add(elements[capsule.joint], "geom", name=f"capsule {capsule.name}", contype="0",
            conaffinity="0", **_link(capsule))
    pairs = np.array(pairs_of_tree(robot.capsules, robot.parents), dtype=np.int64).reshape(-1, 2)
    seen = measure_capsules(State.at(robot, q).placements, *pack_capsules(robot.capsules), pairs)
    for i, j in pairs[seen[:, 0] > 0.0]:
        names = (f"capsule {robot.capsules[k].name}" for k in (i, j))
        add(contact, "pair", **dict(zip(("geom1", "geom2"), names, strict=True)), condim="3",
            friction=(_SKIN, _SKIN, 0, 0, 0))


def _bodies(world: Element, robot: Robot, drives: Sequence[dict[str, ArrayLike]],
            least: tuple[float, float] = (0.0, 0.0), **values: ArrayLike) -> list[Element]:
    """Add bodies "body NAME" and their joints to a world; return it and the bodies' elements.

    drives : attributes of the joint of each velocity (n). least : at least a mass [kg] and moments
    of inertia [kg m^2] more. values : of each body.
    """
    of_joint, elements = _axes(robot), [world]
    for i, body in enumerate(robot.bodies()):
        element = add(elements[body.parent], "body", name=f"body {body.name}", pos=body.position,
                      xyaxes=axes(body.rotation), **values)
        elements.append(element)
        I = body.inertia + least[1] * np.eye(3)  # noqa: E741
        add(element, "inertial", mass=max(body.mass, least[0]), pos=body.centre,
            fullinertia=I[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
        if i == 0 and robot.base == "floating":
            add(element, "joint", type="free", armature=robot.model.armature[0])
            continue
        kind, axis, v = of_joint[i + 1]
        add(element, "joint", name=body.name, type=kind, axis=axis, **drives[v])
    return elements


def of_drives(robot: Robot, key: str, value: float | None) -> Array:
    """Return a property (n,) of the drives: one value, or a share of their effort limits."""
    if value is not None:
        return np.full(robot.n, value)
    return np.where(np.isfinite(robot.effort_limit), _DRIVE[key] * robot.effort_limit, 0.0)


def _shape(contact: Contact) -> dict[str, Any]:
    """Return a box above the corners of a sole, or a ball around a point.

    The ball's lowest point in the start's posture need not be the contact's point.
    """
    frame, points = contact.frame, np.array(contact.points, dtype=float)
    if not contact.is_surface:
        return {"type": "sphere", "pos": frame.placed(points[0]), "size": BALL}
    corners, R = points @ contact.sole.T, frame.rotation @ contact.sole.T
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle = frame.offset + R @ ((low + high) / 2 + [0.0, 0.0, _THICKNESS])
    return {"type": "box", "pos": middle, "xyaxes": axes(R),
            "size": (*(high - low)[:2] / 2, _THICKNESS)}


def _equalities(root: Element, robot: Robot, elements: list[Element], timestep: float) -> None:
    """Add what the robot couples and closes, as stiff as the time step allows."""
    equality = add(root, "equality")
    stiff = {"solref": (2.0 * timestep, 1.0), "solimp": (0.9999, 0.9999, 0.001)}
    for one in robot.coupled:
        joints = {"joint1": one.joint} | ({"joint2": one.other} if one.other else {})
        add(equality, "joint", **joints, polycoef=(*one.coefficients, *[0.0] * 5)[:5], **stiff)
    for loop in robot.loops:
        sites = {f"site{i}": f"{loop.name} {i}" for i in (1, 2)}
        for name, frame in zip(sites.values(), map(robot.frame, loop.frames), strict=True):
            add(elements[frame.joint], "site", name=name, pos=frame.offset,
                xyaxes=axes(frame.rotation))
        add(equality, "weld" if loop.rigid else "connect", **sites, **stiff)


def _axes(robot: Robot) -> dict[int, tuple[str, Array, int]]:
    """Return kind, axis (3,) in its own frame, and velocity of each joint with one velocity."""
    state, found = State(robot), {}
    for joint in range(2 if robot.base == "floating" else 1, len(robot.parents)):
        own = np.flatnonzero(state.supports[joint] & ~state.supports[robot.parents[joint]])
        slide, turn = state.J[:3, own].sum(axis=1), state.J[3:, own].sum(axis=1)
        kind, axis = ("hinge", turn) if turn.any() else ("slide", slide)
        if len(own) != 1:
            raise ScenarioError(f"joint {robot.joint_names[joint - 1]!r} does not turn about or "
                                "slide along one axis")
        found[joint] = kind, state.placements[joint, :9].reshape(3, 3) @ axis, int(own[0])
    return found


@final
class Stops:
    """The position limits of a robot's joints.

    A joint that is more than `beyond` [rad or m] past one has gone through its stop. Where a joint
    starts beyond a limit, at q (nq,), its stop is there.
    """

    def __init__(self, robot: Robot, q: Array, beyond: float) -> None:
        self._robot, self._of, self._beyond = robot, robot.coordinates, beyond
        lower, upper = robot.position_limits()
        self._lower, self._upper = np.minimum(lower, q[self._of]), np.maximum(upper, q[self._of])

    def passed(self, q: Array) -> str | None:
        """Return which joint at q (nq,) is farthest beyond its stop, None if none is too far."""
        here = q[self._of]
        over = np.maximum(self._lower - here, here - self._upper)
        i = int(over.argmax())
        if not over[i] > self._beyond:
            return None
        stop = self._upper[i] if here[i] > self._upper[i] else self._lower[i]
        name, unit = self._robot.velocity_names[i], self._robot.velocity_units[i]
        return (f"joint {name} is {over[i]:.2g} {unit} beyond its stop at {stop:.4g} "
                f"{unit} (plant.beyond_stop = {self._beyond:g}),")
