"""What an entrant's answers to `stand` are worth, by our model and from its answers alone."""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy.optimize import nnls

from benchmark.stand.ours import TASKS, robot_of, stack_of
from benchmark.stand.scene import Stand
from benchmark.store import Row
from benchmark.turns import Log, times
from hierarchy import State
from hierarchy.problem import Array
from hierarchy.tasks import Pose

BASE = 6


class Judge:
    """Residuals of answers, with the model and tasks of our own stack."""

    def __init__(self, scene: Stand, states: dict[str, Array]) -> None:
        self.scene, self.states, self.robot = scene, states, robot_of(scene)
        self.state = State.at(self.robot, scene.rest)
        self.stack, self.contacts = stack_of(scene, self.robot, self.state)
        self.soles = [Pose(contact.frame, path, np.eye(3)) for contact, path in zip(
            self.contacts.contacts, [self.stack["left hand"].path] * 2,  # type: ignore[attr-defined]
            strict=True)]

    def residuals(self, tick: int, a: Array, torques: Array, wrenches: Array) -> dict[str, float]:
        """Return how far an answer at a state is from physics and limits, and misses each task.

        dynamics [N m, N]: of the equations of motion. contact [m/s^2, rad/s^2]: of the soles' rest.
        torque [N m]: beyond a limit. friction [N]: of a sole's wrench (moments over the sole's half
        length) from what its corners can push inside their pyramids, which stand on the sole or, as
        ours, on the floor. The tasks [m/s^2, rad/s^2]: norm of what is missed.
        """
        scene, states = self.scene, self.states
        state, found = self.state, {}
        state.move(float(states["t"][tick]), states["q"][tick], states["v"][tick])
        effort = state.mass_matrix() @ a + state.bias_effort()
        effort[BASE:] -= torques
        for sole, wrench in zip(self.soles, wrenches, strict=True):
            effort -= sole.jacobian(state).T @ wrench
        found["dynamics"] = float(np.abs(effort).max())
        h = self.stack.hierarchy(state)
        missed = h.A[:, :len(a)] @ a - h.lower  # of rows of accelerations, which are equalities
        found["contact"] = float(np.abs(missed[BASE:h.offsets[1]]).max())
        found["torque"] = max(float((np.abs(torques) - scene.torque).max()), 0.0)
        found["friction"] = max(self._outside(i, wrench) for i, wrench in enumerate(wrenches))
        return {**found, **{task: float(np.linalg.norm(
            missed[h.offsets[k]:h.offsets[k + 1]])) for k, task in enumerate(h.names)
            if task in TASKS}}

    def _outside(self, i: int, wrench: Array) -> float:
        sole = self.state.rotation(self.contacts.contacts[i].frame)
        scaled = np.concatenate([wrench[:3], wrench[3:] / self.scene.half[0]])
        return min(float(nnls(_pushes(self.scene, sole, axes), scaled)[1])
                   for axes in (sole, np.eye(3)))


def _pushes(scene: Stand, sole: Array, axes: Array) -> Array:
    """Return the edges of the pyramids at the corners of a sole as wrenches (6, 16)."""
    mu, half = scene.friction, scene.half[0]
    edges = np.array([[x, y, 1.0] for x, y in product((mu, -mu), repeat=2)]) @ axes.T
    return np.array([np.concatenate([edge, np.cross(corner, edge) / half])
                     for corner in scene.corners @ sole.T for edge in edges]).T


def judge(log: Log, of: Judge) -> Row:
    """Return times of an entrant, and median and largest of each residual over the states."""
    answered = np.flatnonzero(np.logical_not(log["failed"]))
    once = answered[np.unique(log["state"][answered], return_index=True)[1]]
    found = [of.residuals(int(log["state"][i]), log["a"][i], log["torques"][i],
                          log["wrenches"][i]) for i in once]
    row = times(log)
    for key in found[0] if found else ():
        values = [one[key] for one in found]
        row[f"{key} median"], row[f"{key} max"] = float(np.median(values)), float(max(values))
    return row
