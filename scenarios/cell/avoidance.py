"""Make tasks and surveillance areas from [avoidance]."""

from __future__ import annotations

from hierarchy import HierarchyError, Task
from hierarchy.avoidance import SurveillanceAreas
from hierarchy.tasks import Avoidance, Separation
from hierarchy.tasks.self_separation import SelfSeparation
from scenarios.cell.published import PublishedAvoidance
from scenarios.cell.robot import sensed_points
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import AvoidanceSection, SeparationSection
from scenarios.config.references import References


def areas_of(scenario: Scenario) -> SurveillanceAreas | None:
    """Return the areas of Algorithm 1, or None if it is not used."""
    section = scenario.avoidance
    if not isinstance(section, AvoidanceSection) or section.place == "null-space":
        return None
    return SurveillanceAreas(section.near, section.far, section.end_effector)


def avoidance_tasks(scenario: Scenario, at: References) -> list[Task]:
    """Return the tasks that avoid obstacles and self-collision."""
    section = scenario.avoidance
    if section is None:
        return []
    if isinstance(section, SeparationSection):
        return _separation(section, at, scenario.sensor.kind == "exact")
    if section.place == "null-space":
        return []
    kind = PublishedAvoidance if section.jacobian == "published" else Avoidance
    return [kind(at.robot.control_points, section.dimension)]


def _separation(section: SeparationSection, at: References, exact: bool) -> list[Task]:
    tasks: list[Task] = []
    if section.obstacles or not exact:
        tasks.append(Separation(sensed_points(at.robot), section.barrier(section.distance),
                                len(section.obstacles) if exact else None))
    if section.self_collision is not None:
        try:
            barrier, pairs = section.barrier(section.self_collision), at.pairs(
                section.self_collision)
        except HierarchyError as error:
            raise ScenarioError(f"avoidance.self_collision: {error}") from error
        tasks.append(SelfSeparation(at.robot.capsules, barrier, pairs))
    return tasks
