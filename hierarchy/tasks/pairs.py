"""Pairs of capsules of a robot that can be kept apart."""

import numpy as np

from hierarchy.avoidance.body import measure_capsules, pack_capsules, pairs_of_tree
from hierarchy.robot import Robot
from hierarchy.state import State

Pairs = list[tuple[int, int]]
_POSTURES = 200


def separable_pairs(robot: Robot, distance: float) -> Pairs:
    """Return the pairs of capsules that can be kept at a distance [m], as indices.

    Neighbours in the tree share a joint and are excluded, and so are pairs that the file excludes.
    Capsules proposed from a file may be too large: of them, pairs that overlap in the robot's own
    posture are excluded too, and those that are nearer than `distance` in every one of 200 sampled
    postures.
    """
    pairs = _watched(robot)
    if robot.table is not None or not pairs:
        return pairs
    packed, at = pack_capsules(robot.capsules), State(robot)
    lower, upper = (np.where(np.isfinite(side), side, turn) for side, turn in
                    zip(robot.position_limits(), (-np.pi, np.pi), strict=True))
    postures = np.random.default_rng(0).uniform(lower, upper, (_POSTURES, robot.n))
    steps = (np.zeros(robot.n), *(postures - robot.vector(robot.rest)))
    seen = np.array([measure_capsules(at.placements, *packed, np.array(pairs))[:, 0]
                     for step in steps
                     if at.move(0.0, robot.integrate(robot.rest, step), np.zeros(robot.n))])
    apart = (seen[0] > 0.0) & (seen.max(axis=0) >= distance)
    return [pair for pair, kept in zip(pairs, apart.tolist(), strict=True) if kept]


def inseparable_pairs(robot: Robot, distance: float) -> list[str]:
    """Return the names of the pairs that `separable_pairs` excludes for their proposed capsules."""
    kept = set(separable_pairs(robot, distance))
    return [f"{robot.capsules[i].name} to {robot.capsules[j].name}"
            for i, j in _watched(robot) if (i, j) not in kept]


def _watched(robot: Robot) -> Pairs:
    """Return the pairs of capsules on joints that are no neighbours and may not touch."""
    names = ("", *robot.joint_names)
    apart = {frozenset(pair) for pair in robot.apart}
    return [(i, j) for i, j in pairs_of_tree(robot.capsules, robot.parents)
            if frozenset(names[robot.capsules[k].joint] for k in (i, j)) not in apart]
