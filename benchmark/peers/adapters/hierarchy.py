"""Our own ticks, State.move, Stack.hierarchy and Resolver.solve, and our inverse kinematics."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from benchmark.peers.scenes import Answer, Arm, Array, RefusedError, Stand, wrench
from hierarchy import Robot, Stack, State, Task, tasks
from hierarchy.contacts import Contact, Contacts
from hierarchy.paths import Ellipse, Still
from solvers import Resolution, Status, make, solve_ik

TASKS = ("centre of mass", "left hand", "right hand", "posture")
_UNLIMITED = 1e9  # [rad/s^2]
_STRICT = 2       # levels of `stand` that weights do not touch: physics and limits
_ANSWERED = {"velocity": (Status.SOLVED,), "torque": (Status.SOLVED, Status.INACCURATE)}


class _Solver:
    """Solves the stack at a state, tick after tick, from the memory of the tick before."""

    def __init__(self, state: State, stack: Stack, call: Callable[..., Resolution]) -> None:
        self.state, self.stack, self.call = state, stack, call
        self.memory: Array | None = None
        self.before: Array | None = None

    def solve(self, t: float, q: Array, v: Array) -> Resolution:
        """Solve a tick; RefusedError without an answer."""
        if not self.state.move(t, q, v):
            raise RefusedError("State.move is False")
        self.h = self.stack.hierarchy(self.state)
        res = self.call(self.h, self.memory)
        if res.status not in _ANSWERED[self.stack.level]:
            raise RefusedError(res.status.name)
        self.before, self.memory = self.memory, res.memory
        return res

    def again(self) -> object:
        """Solve the last tick's problem again."""
        return self.call(self.h, self.before)


def arm(scene: Arm, posture: bool, resolver: str | Callable[..., Resolution], **settings: Any
        ) -> tuple[Any, Any]:
    """Velocity limits, position and posture, with any resolver; the path is our own."""
    robot = Robot.from_file(scene.file, scene.frame)
    robot.lower, robot.upper = np.full(robot.n, -np.inf), np.full(robot.n, np.inf)
    path = Ellipse(scene.centre, scene.cosine, scene.sine, scene.turning)
    asked = [tasks.JointLimits(robot, _UNLIMITED, scene.period),
             tasks.Position(robot.frame(scene.frame), path, gain=scene.gain),
             tasks.Posture(tuple(scene.posture), gain=scene.posture_gain)]
    stack = Stack(asked if posture else asked[:2], "velocity")
    solver = _Solver(State.at(robot, scene.start), stack,
                     make(resolver, **settings).solve if isinstance(resolver, str) else resolver)

    def velocity(t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        return solver.solve(t, q, v).x

    return velocity, solver.again


def robot_of(scene: Stand) -> Robot:
    """Read the robot of the scene."""
    return Robot.from_file(scene.file, scene.hands[1], base="floating", shapes=False)


def stack_of(scene: Stand, robot: Robot, state: State) -> tuple[Stack, Contacts]:
    """Return the seven levels of the scene, with contacts held where they are at `state`."""
    half, mu = scene.half, scene.friction * np.sqrt(2.0)  # the faces are inside the cone
    contacts = Contacts(robot, [Contact.rectangle(robot.frame(sole), (-half[0], half[0]),
                                                  (-half[1], half[1]), mu)
                                for sole in scene.soles])
    com, *hands = (Ellipse(*circle) for circle in scene.circles)
    stiffness, damping, _ = scene.com
    wanted: list[Task] = [
        tasks.CentreOfMass(robot, com, stiffness=stiffness, damping=damping),
        *(tasks.Position(robot.frame(frame), path, *scene.hand[:2], name=name)
          for frame, path, name in zip(scene.hands, hands, TASKS[1:3], strict=True))]
    held = tasks.ContactMotion.at(state, contacts, *scene.contact[:2])
    torques = tasks.TorqueLimits(robot, contacts=contacts)
    return Stack([
        tasks.Together([tasks.BaseDynamics(contacts), held], "physics"),
        tasks.Together([torques, tasks.Friction(contacts)], "limits"),
        *wanted, tasks.Posture(tuple(scene.posture), *scene.joint[:2]),
        tasks.LeastForce(contacts)], "torque", contacts=contacts), contacts


def stand(scene: Stand, resolver: str) -> tuple[Any, Any]:
    """Strict levels, or with `weighted` physics and limits strict and the rest as one level."""
    robot = robot_of(scene)
    state = State.at(robot, scene.rest)
    stack, contacts = stack_of(scene, robot, state)
    weights = {} if resolver != "weighted" else {"strict_levels": _STRICT, "weights": (
        *(1.0,) * _STRICT, scene.com[2], scene.hand[2], scene.hand[2], scene.joint[2],
        scene.force)}
    solver = _Solver(state, stack, make(resolver, **weights).solve)

    def tick(t: float, q: Array, v: Array, targets: Array) -> Callable[[], Answer]:
        x = solver.solve(t, q, v).x
        return partial(answer, x, contacts.torques(state, x))

    def answer(x: Array, torques: Array) -> Answer:
        wrenches, forces = [], contacts.forces(x).reshape(2, 4, 3)
        for contact, of in zip(contacts.contacts, forces, strict=True):
            R = state.rotation(contact.frame)
            wrenches.append(wrench(R, np.array(contact.points), of @ R))
        return Answer(contacts.accelerations(x), torques, np.array(wrenches))

    return tick, solver.again


def reach(file: str, frames: list[str], tolerance: float) -> Callable[..., tuple[Array, bool]]:
    """`solve_ik` with `until`, with pose tasks of one level."""
    robot = Robot.from_file(file, shapes=False)
    placed = [robot.frame(name) for name in frames]

    def solve(poses: Array, starts: Array) -> tuple[Array, bool]:
        hands = [tasks.Pose(frame, Still(pose[:3, 3]), pose[:3, :3], name=frame.name)
                 for frame, pose in zip(placed, poses, strict=True)]
        found = solve_ik(robot, starts[0], [tasks.Together(hands, "hands")], until=tolerance)
        return found.q, found.met

    return solve
