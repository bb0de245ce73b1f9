"""What an entrant's answers to `stand` are worth, by our model and from its answers alone."""

from __future__ import annotations

from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import nnls

from hierarchy import State
from hierarchy.problem import Array
from hierarchy.tasks import Pose
from scenarios.bench.peers.stand.ours import TASKS, robot_of, stack_of
from scenarios.bench.peers.stand.scene import Stand

BASE = 6


def read_log(file: Path) -> dict[str, Array]:
    """Read what `scenarios.bench.peers.stand.worker` wrote."""
    with np.load(file) as kept:
        return {key: kept[key] for key in kept.files}


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


def judge(log: dict[str, Array], of: Judge) -> dict[str, Any]:
    """Return times [us] of an entrant, and median and largest of each residual over the states."""
    answered = np.logical_not(log["failed"])
    counted = np.logical_and(log["clocked"], answered)
    times, again = log["time"][counted] / 1e3, log["resolve"][counted] / 1e3
    median, p95, p999 = (np.percentile(times, [50.0, 95.0, 99.9]).tolist() if len(times)
                         else [None] * 3)
    once = np.unique(log["state"][answered], return_index=True)[1]
    rows = np.flatnonzero(answered)[once]
    found = [of.residuals(int(log["state"][i]), log["a"][i], log["torques"][i],
                          log["wrenches"][i]) for i in rows]
    row: dict[str, Any] = {
        "ticks": int(log["clocked"].sum()), "failed": int(log["failed"].sum()),
        "median_us": median, "p95_us": p95, "p99.9_us": p999,
        "solve_us": float(np.median(again)) if again.any() else None, "why": str(log["why"])}
    for key in found[0] if found else ():
        values = [one[key] for one in found]
        row[f"{key} median"], row[f"{key} max"] = float(np.median(values)), float(max(values))
    return row
