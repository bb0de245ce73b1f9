"""Our own tick: State.move, Stack.hierarchy, Resolver.solve."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmark.arm.scene import Array, RefusedError, Scene
from hierarchy import Robot, Stack, State
from hierarchy.paths import Ellipse
from hierarchy.tasks import JointLimits, Position, Posture
from solvers import Resolver, Status, make

_UNLIMITED = 1e9  # [rad/s^2]


class Ours:
    """A stack of velocity limits, position and posture, with any resolver."""

    package = "task-hierarchy"
    priorities = "strict"
    rows = "any, in any level"

    def __init__(self, scene: Scene, posture: bool, resolver: str | Resolver,
                 **settings: Any) -> None:
        robot = Robot.from_file(scene.file, scene.frame)
        robot.lower, robot.upper = np.full(robot.n, -np.inf), np.full(robot.n, np.inf)
        path = Ellipse(scene.centre, scene.cosine, scene.sine, scene.turning)
        tasks = [JointLimits(robot, _UNLIMITED, scene.period),
                 Position(robot.frame(scene.frame), path, gain=scene.gain),
                 Posture(scene.posture, gain=scene.posture_gain)]
        self.stack = Stack(tasks if posture else tasks[:2], "velocity")
        self.state = State.at(robot, scene.start)
        self.resolver = make(resolver, **settings) if isinstance(resolver, str) else resolver
        self.memory: Array | None = None
        self.before: Array | None = None

    def velocity(self, t: float, q: Array, v: Array, goal: Array, rate: Array) -> Array:
        """See `Adapter`; goal and rate come from our own path."""
        if not self.state.move(t, q, v):
            raise RefusedError("State.move is False")
        self.h = self.stack.hierarchy(self.state)
        res = self.resolver.solve(self.h, self.memory)
        if res.status is not Status.SOLVED:
            raise RefusedError(res.status.name)
        self.before, self.memory = self.memory, res.memory
        return res.x

    def resolve(self) -> object:
        """See `Adapter`."""
        return self.resolver.solve(self.h, self.before)


class Bounds(Ours):
    """With a resolver that handles only bounds."""

    rows = "bounds of joints, first"


class Weighted(Ours):
    """With weights instead of levels."""

    priorities = "weights"
