"""Our own tick: State.move, Stack.hierarchy, Resolver.solve, torques."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmark.arm.scene import RefusedError
from benchmark.stand.scene import Answer, Array, Stand, wrench
from hierarchy import Robot, Stack, State, Task
from hierarchy.contacts import Contact, Contacts
from hierarchy.paths import Ellipse
from hierarchy.tasks import (
    BaseDynamics,
    CentreOfMass,
    ContactMotion,
    Friction,
    LeastForce,
    Position,
    Posture,
    Together,
    TorqueLimits,
)
from solvers import Status, make

TASKS = ("centre of mass", "left hand", "right hand", "posture")
_STRICT = 2  # physics and limits


def stack_of(scene: Stand, robot: Robot, state: State) -> tuple[Stack, Contacts]:
    """Return the stack of the scene, with contacts held where they are at `state`."""
    half, mu = scene.half, scene.friction * np.sqrt(2.0)  # the faces are inside the cone
    contacts = Contacts(robot, [Contact.rectangle(robot.frame(sole), (-half[0], half[0]),
                                                  (-half[1], half[1]), mu)
                                for sole in scene.soles])
    com, *hands = (Ellipse(*circle) for circle in scene.circles)
    wanted: list[Task] = [CentreOfMass(robot, com, stiffness=scene.com.stiffness,
                                       damping=scene.com.damping)]
    wanted += [Position(robot.frame(frame), path, scene.hand.stiffness, scene.hand.damping,
                        name=name)
               for frame, path, name in zip(scene.hands, hands, TASKS[1:3], strict=True)]
    held = ContactMotion.at(state, contacts, scene.contact.stiffness, scene.contact.damping)
    return Stack([
        Together([BaseDynamics(contacts), held], "physics"),
        Together([TorqueLimits(robot, contacts=contacts), Friction(contacts)], "limits"),
        *wanted, Posture(scene.posture, scene.joint.stiffness, scene.joint.damping),
        LeastForce(contacts)], "torque", contacts=contacts), contacts


def robot_of(scene: Stand) -> Robot:
    """Read the robot of the scene."""
    return Robot.from_file(scene.file, scene.hands[1], base="floating", shapes=False)


class Ours:
    """Seven levels: physics, limits, centre of mass, hands, posture, least force."""

    package = "task-hierarchy"
    priorities = "7 strict levels"

    def __init__(self, scene: Stand, resolver: str, **settings: Any) -> None:
        self.scene, self.robot = scene, robot_of(scene)
        self.state = State.at(self.robot, scene.rest)
        self.stack, self.contacts = stack_of(scene, self.robot, self.state)
        self.resolver = make(resolver, **settings)
        self.memory: Array | None = None
        self.before: Array | None = None

    def tick(self, t: float, q: Array, v: Array, targets: Array) -> None:
        """See `Adapter`; the targets come from our own paths."""
        if not self.state.move(t, q, v):
            raise RefusedError("State.move is False")
        self.h = self.stack.hierarchy(self.state)
        res = self.resolver.solve(self.h, self.memory)
        if res.status not in (Status.SOLVED, Status.INACCURATE):
            raise RefusedError(res.status.name)
        self.before, self.memory, self.x = self.memory, res.memory, res.x
        self.torques = self.contacts.torques(self.state, res.x)

    def answer(self) -> Answer:
        """See `Adapter`."""
        forces = self.contacts.forces(self.x).reshape(2, 4, 3)
        wrenches = []
        for contact, of in zip(self.contacts.contacts, forces, strict=True):
            R = self.state.rotation(contact.frame)
            wrenches.append(wrench(R, np.array(contact.points), of @ R))
        return Answer(self.contacts.accelerations(self.x), self.torques, np.array(wrenches))

    def resolve(self) -> object:
        """See `Adapter`."""
        return self.resolver.solve(self.h, self.before)


class Weighted(Ours):
    """Two levels with weights: physics and limits strict, the rest one weighted level."""

    priorities = "2 levels, weights"

    def __init__(self, scene: Stand) -> None:
        rest = (scene.com.weight, scene.hand.weight, scene.hand.weight, scene.joint.weight,
                scene.force)
        super().__init__(scene, "weighted", strict_levels=_STRICT, weights=(1.0,) * _STRICT + rest)
