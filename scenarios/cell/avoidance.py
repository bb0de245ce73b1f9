"""Make tasks, surveillance areas and repulsion laws from [avoidance]."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from hierarchy import HierarchyError, Robot, State, Task
from hierarchy.avoidance import Barrier, Repulsion, SurveillanceAreas
from hierarchy.avoidance.self_collision import measure_capsules, pack_capsules, pairs_of_tree
from hierarchy.problem import Array
from hierarchy.tasks import Avoidance, Separation
from hierarchy.tasks.self_separation import SelfSeparation
from scenarios.cell.published import PublishedAvoidance
from scenarios.cell.robot import sensed_points
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceSection, RepulsionSection, SeparationSection

_POSTURES = 200


def areas_of(scenario: Scenario) -> SurveillanceAreas | None:
    """Return the areas of Algorithm 1, or None if it is not used."""
    section = scenario.avoidance
    if not isinstance(section, AvoidanceSection) or section.place == "null-space":
        return None
    return SurveillanceAreas(section.near, section.far, section.end_effector)


def repulsion_of(section: RepulsionSection) -> Repulsion:
    """Return the repulsion law of a section."""
    return Repulsion(section.maximum, section.reach, section.shape, section.scale)


def avoidance_tasks(scenario: Scenario, robot: Robot) -> list[Task]:
    """Return the tasks that avoid obstacles and self-collision."""
    section = scenario.avoidance
    if section is None:
        return []
    if isinstance(section, SeparationSection):
        return _separation(section, robot, scenario.sensor.kind == "exact")
    if section.place == "null-space":
        return []
    kind = PublishedAvoidance if section.jacobian == "published" else Avoidance
    return [kind(robot.control_points, section.dimension)]


def _separation(section: SeparationSection, robot: Robot, exact: bool) -> list[Task]:
    tasks: list[Task] = []
    if section.obstacles or not exact:
        barrier = Barrier(section.distance, section.rate, section.influence, section.recovery,
                          section.limit)
        tasks.append(Separation(sensed_points(robot), barrier,
                                len(section.obstacles) if exact else None))
    if section.self_collision is not None:
        pairs = separable_pairs(robot, section.self_collision)
        if not pairs:
            raise ScenarioError(f"avoidance.self_collision: robot {robot.name!r} has no capsules "
                                "that could be kept apart; list them in robot.capsules")
        try:
            barrier = Barrier(section.self_collision, section.rate, section.influence,
                              section.recovery, section.limit)
        except HierarchyError as error:
            raise ScenarioError(f"avoidance.self_collision: {error}") from error
        tasks.append(SelfSeparation(robot.capsules, barrier, pairs))
    return tasks


def separable_pairs(robot: Robot, distance: float) -> list[tuple[int, int]]:
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
    postures = (robot.rest, *_postures(robot))
    seen = np.array([measure_capsules(at.placements, *packed, np.array(pairs))[:, 0]
                     for q in postures if at.move(0.0, q, np.zeros(robot.n))])
    apart = (seen[0] > 0.0) & (seen.max(axis=0) >= distance)
    return [pair for pair, kept in zip(pairs, apart.tolist(), strict=True) if kept]


def inseparable_pairs(robot: Robot, distance: float) -> list[str]:
    """Return the names of the pairs that `separable_pairs` excludes for their proposed capsules."""
    kept = set(separable_pairs(robot, distance))
    return [f"{robot.capsules[i].name} to {robot.capsules[j].name}"
            for i, j in _watched(robot) if (i, j) not in kept]


def _watched(robot: Robot) -> list[tuple[int, int]]:
    """Return the pairs of capsules on joints that are no neighbours and may not touch."""
    names = ("", *robot.joint_names)
    apart = {frozenset(pair) for pair in robot.apart}
    return [(i, j) for i, j in pairs_of_tree(robot.capsules, robot.parents)
            if frozenset(names[robot.capsules[k].joint] for k in (i, j)) not in apart]


def _postures(robot: Robot) -> Iterator[Array]:
    """Yield postures (nq,) spread evenly within the limits, a turn where there are none."""
    generator, start = np.random.default_rng(0), robot.vector(robot.rest)
    lower, upper = (np.where(np.isfinite(side), side, turn) for side, turn in
                    zip(robot.position_limits(), (-np.pi, np.pi), strict=True))
    for _ in range(_POSTURES):
        yield robot.integrate(robot.rest, generator.uniform(lower, upper) - start)
