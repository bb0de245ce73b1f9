"""Make the robot, its start and its contacts from [robot], [start] and [[contacts]].

Contacts must stand on the plant's floor at the start: the controller plans forces at every point of
a closed contact from the first tick on. A point 2 mm above the floor takes 20 ms to come down,
while contacts that stand give way by 0.1 mm; until then the robot does not do what was planned.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from hierarchy import Robot, Stack, State
from hierarchy.avoidance import Capsule, ControlPoint
from hierarchy.contacts import Contact, Contacts, corners
from hierarchy.paths import Still
from hierarchy.problem import Array
from hierarchy.tasks import Position
from hierarchy.tasks.joints.mechanism import Mechanism, model_rows
from scenarios.cell.plants.mjcf import BALL
from scenarios.config import Scenario, ScenarioError
from scenarios.config.sections import naming
from scenarios.config.sections.plant import TorqueSection
from scenarios.config.sections.references import References
from scenarios.config.sections.robot import ContactSection, PointSection, RobotSection, StartSection
from solvers import make

_REACHED = 1e-6      # [m]
_REACH_STEPS = 500   # damped Newton steps; a reachable point takes about ten
_ON_LIMIT = 1e-9     # [rad or m] beyond a limit that is rounding
_LONGEST_STEP = 0.3  # [rad] of any joint
CLOSED = 1e-3        # [m or rad] by which rounding in a file may leave a mechanism open
_SINK = 2e-5         # [m] that on_floor presses a contact down: at 0 rounding decides if it carries
_OFF = 0.002         # [m] of a point from the floor that is too far
_TILTED = 1.0        # [deg] of a sole from the floor that is too much
_ON_EDGE, _TURNED_OVER = 45.0, 135.0  # [deg] from which another plane of its frame must be meant


def placed(scenario: Scenario) -> References:
    """Return the robot of a scenario at its start, with its contacts at level "torque".

    With start.on_floor the base is raised or lowered so that the lowest contact touches the floor.
    Raises a ScenarioError for a fixed base then, if a section does not fit the robot, for a contact
    that does not stand on the plant's floor, or for a floating base with its centre of mass below
    it. A contact that is open at the start may be anywhere, one that slides above the floor.
    """
    robot, plant = make_robot(scenario.robot), scenario.plant
    start = State.at(robot, *start_of(robot, scenario.start))
    if scenario.control.level != "torque":
        return References(start)
    contacts = _contacts(scenario.contacts, robot)
    floor = plant.height if isinstance(plant, TorqueSection) else 0.0
    if scenario.start.on_floor:
        start = _lowered(contacts, start, floor)
    if isinstance(plant, TorqueSection):
        if found := list(_astray(contacts, start, floor)):
            raise ScenarioError(min(found)[1])
        above = float(start.centre_of_mass()[2]) - floor
        if robot.base == "floating" and above < 0.0:  # it hangs from its contacts
            raise ScenarioError(f"start: the centre of mass is {-1e3 * above:.3g} mm below the "
                                "floor. Is the base upside down? Its quaternion in start.q is "
                                "x, y, z, w")
    return References(start, contacts)


@naming("robot")
def make_robot(section: RobotSection) -> Robot:
    """Make the robot of a scenario, with the control points and capsules of the section."""
    robot = Robot.load(section.model, section.end_effector, section.base, section.locked,
                       section.root)
    if section.control_points is not None:
        robot.control_points = tuple(point_of(robot, point, f"control_points.{i}")
                                     for i, point in enumerate(section.control_points))
    if section.capsules is not None:
        base = 1 if robot.base == "floating" else 0
        robot.capsules = tuple(
            Capsule(f"{capsule.joint or 'base'} {i}",
                    base if capsule.joint is None else robot.joint(capsule.joint),
                    capsule.start, capsule.end, capsule.radius)
            for i, capsule in enumerate(section.capsules, 1))
    return robot


def point_of(robot: Robot, section: PointSection, key: str) -> ControlPoint:
    """Return a point of the robot; raises ScenarioError, naming its key, if there is none."""
    with naming(key):
        if section.joint is not None:
            return robot.control_point(section.joint, section.offset)
        return robot.control_point_of_frame(str(section.frame), section.offset)


def sensed_points(robot: Robot) -> tuple[ControlPoint, ...]:
    """Return the points that a sensor measures: control points, then the end effector."""
    end = robot.frame(robot.end_effector)
    return (*robot.control_points, ControlPoint(end.name, end.joint, end.offset))


def on_column(robot: Robot, links: tuple[Capsule, ...], foot: float) -> tuple[Capsule, ...]:
    """Return links of a robot; with a fixed base a column of height `foot` [m] is below them."""
    if foot == 0.0 or robot.base == "floating" or not links:
        return links
    return (Capsule("foot", 0, (0.0, 0.0, -foot), (0.0, 0.0, 0.0), links[0].radius), *links)


def start_of(robot: Robot, section: StartSection) -> tuple[Array, Array]:
    """Return q (nq,) and v (n,) of the start, with the end effector at the requested point.

    Raises ScenarioError if the section does not fit the robot, or the point is out of reach.
    """
    state = _state(robot, section)
    q, v = state.q.copy(), state.v.copy()
    if section.end_effector is not None:
        q = _reach(robot, q, np.array(section.end_effector))
    beyond = (q < robot.lower - _ON_LIMIT) | (q > robot.upper + _ON_LIMIT)
    if beyond.any() and not section.allow_outside_limits:
        i = int(beyond.argmax())
        degrees = " Are these degrees?" if abs(q[i]) > 2.0 * np.pi else ""
        raise ScenarioError(
            f"start: {robot.coordinate_names[i]} at {q[i]:g} is beyond its limits, "
            f"{robot.lower[i]:.4g} to {robot.upper[i]:.4g} (rad or m).{degrees} "
            "start.allow_outside_limits = true allows it")
    return q, v


def _state(robot: Robot, section: StartSection) -> State:
    mechanism = Mechanism(robot)
    with naming("start"):
        q = (robot.configuration(section.q) if section.q is not None else robot.rest
             if section.keyframe is None else robot.start(section.keyframe))
        q = mechanism.closed(robot.configuration(section.joints, q), section.joints)
        state = State.at(robot, q, section.v)
    gap, where = mechanism.gap(q)
    if gap > CLOSED:
        raise ScenarioError(f"start: {where}: the robot's mechanism stays open by {gap:.3g} (m or "
                            "rad) there; give other start.joints")
    return state


def _reach(robot: Robot, q: Array, point: Array) -> Array:
    """Return a posture near q with the end effector at a point [m]; raises ScenarioError."""
    frame, resolver = robot.frame(robot.end_effector), make("tpm", damping=0.05)
    mechanism = Mechanism(robot)
    stack = Stack([*model_rows(robot), Position(frame, Still(point.tolist()), gain=1.0)],
                  "velocity")
    nearest = np.inf
    for _ in range(_REACH_STEPS):
        state = State.at(robot, q)
        distance = float(np.linalg.norm(state.position(frame) - point))
        nearest = min(nearest, distance)
        if distance < _REACHED:
            return q
        step = resolver.solve(stack.hierarchy(state)).x
        step = step * min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
        q = mechanism.closed(robot.integrate(q, step))
    raise ScenarioError(f"start.end_effector {point.tolist()} m cannot be reached: robot "
                        f"{robot.name!r} came no nearer than {nearest:.3g} m")


def _contacts(sections: Sequence[ContactSection], robot: Robot) -> Contacts:
    made = []
    for i, one in enumerate(sections):
        with naming(f"contacts.{i}"):
            with naming("frame"):
                frame = robot.frame(one.frame)
            points: Sequence[Sequence[float]] = (one.offset,)
            if one.x is not None and one.y is not None:
                points = (np.array(one.offset) + corners(one.x, one.y, one.up)).tolist()
            made.append(Contact(frame, points, one.friction, one.normal, one.name or "", one.open,
                                one.ramp, one.slides, one.up))
    with naming("contacts"):
        return Contacts(robot, made)


def _lowered(contacts: Contacts, start: State, floor: float) -> State:
    if contacts.robot.base != "floating" or not contacts.contacts:
        raise ScenarioError("start.on_floor needs a floating base and [[contacts]]")
    q = start.q.copy()
    q[2] += floor - _SINK - min(_heights(contact, start).min() for contact in contacts.contacts)
    return State.at(contacts.robot, q, start.v)


def _astray(contacts: Contacts, start: State, floor: float) -> Iterator[tuple[float, str]]:
    """Yield how far contacts are from the floor, the farthest least, and how they stand there."""
    for i, contact in enumerate(contacts.contacts):
        above = _heights(contact, start) - floor
        waits = contact.load(0.0) == 0.0 or (contact.slides and above[0] > 0.0)
        if not waits and (wrong := _wrong(contact, above, start.rotation(contact.frame))):
            yield -np.abs(above).max(), f"contacts.{i}: at the start {wrong}"


def doubts(scenario: Scenario, contacts: Contacts) -> Iterator[str]:
    """Yield what the controller assumes of the floor and the plant's floor lacks."""
    if not isinstance(scenario.plant, TorqueSection):
        return
    for contact in contacts.contacts:
        if scenario.plant.friction < contact.friction:
            yield (f"contact {contact.name!r}: the controller counts on a friction of "
                   f"{contact.friction:g}, and the plant has {scenario.plant.friction:g} "
                   "(plant.friction): it may slip")
        if (angle := _from_vertical(contact.axes[2])) > _TILTED:
            yield (f"contact {contact.name!r}: its normal is {angle:.3g} deg from vertical, and "
                   "the plant's floor is horizontal")


def _wrong(contact: Contact, above: Array, rotation: Array) -> str | None:
    """Return why a contact with points `above` (k,) [m] the floor does not stand, and a remedy."""
    k, angle = int(np.abs(above).argmax()), _from_vertical(rotation @ contact.sole[2])
    gap = f"{1e3 * abs(above[k]):.3g} mm {'above' if above[k] > 0.0 else 'below'} the floor"
    if contact.is_surface and angle > _ON_EDGE:
        up = ", ".join(f"{value:g}" for value in np.round(rotation[2], 3) + 0.0)
        turned = "turned on edge" if angle < _TURNED_OVER else "upside down"
        return (f"the sole of {contact.name!r} is {turned}, {angle:.0f} deg from the floor. It is "
                f"across `up` in its frame, where the vertical is [{up}] here: set `up`, or take "
                "another frame")
    if contact.is_surface and (angle > _TILTED or np.ptp(above) > _OFF):
        corner = ", ".join(f"{value:g}" for value in contact.points[k])
        return (f"the sole of {contact.name!r} is not flat on the floor but tilted by {angle:.3g} "
                f"deg; its corner ({corner}) is {gap}. Turn it with start.joints")
    if abs(above[k]) > _OFF:
        return (f"{contact.name!r} is {gap}. start.on_floor brings the lowest contact of a "
                "floating base to the floor, start.joints and plant.height others; one that is to "
                "come down later is `open`")
    return None


def _heights(contact: Contact, state: State) -> Array:
    """Return the height (k,) [m] of the lowest place of each point, which is a ball if alone."""
    points = np.array(contact.points, dtype=float) @ state.rotation(contact.frame).T
    heights: Array = (state.position(contact.frame) + points)[:, 2]
    return heights if contact.is_surface else heights - BALL


def _from_vertical(direction: Array) -> float:
    """Return the angle [deg] of a unit vector (3,) from the world's z axis."""
    return float(np.degrees(np.arctan2(np.hypot(direction[0], direction[1]), direction[2])))
