"""Make the tasks of a scenario, in their order: from its sections, its list and its contacts."""

from math import inf
from typing import Any, NamedTuple

from hierarchy import Robot, Task
from hierarchy import tasks as kinds
from hierarchy.avoidance import SurveillanceAreas
from hierarchy.contacts import Contacts
from hierarchy.task import check_period
from hierarchy.tasks.joints.mechanism import above, model_rows
from scenarios.cell.published import PublishedAvoidance
from scenarios.cell.robot import sensed_points
from scenarios.config import Scenario, ScenarioError
from scenarios.config.sections import naming
from scenarios.config.sections.avoidance import AvoidanceSection, SeparationSection
from scenarios.config.sections.control import ControlSection
from scenarios.config.sections.references import References
from scenarios.config.sections.tasks import LimitsSection, Made, alike


class Tasks(NamedTuple):
    """The tasks of a scenario, see `Cell`."""

    all: list[Task]
    position: kinds.Position | None
    pointing: kinds.Pointing | None
    limits: kinds.JointLimits | None
    listed: tuple[Task, ...]
    areas: SurveillanceAreas | None
    reference: Task | None
    give: dict[str, float]


def tasks_of(scenario: Scenario, at: References) -> Tasks:
    """Return the tasks of a scenario, most important first.

    Raises ScenarioError if it asks for nothing, or for what its robot cannot do.
    """
    last = scenario.posture is not None and scenario.posture.role == "task"
    asked = (scenario.position or scenario.pointing or scenario.avoidance or scenario.tasks
             or last)
    if not (asked or at.robot.coupled or at.robot.loops):
        raise ScenarioError(f"scenario {scenario.name!r}: the stack is empty: give at least one of "
                            "[position], [pointing], [avoidance], [[tasks]]")
    limits, first = _first(scenario, at)
    areas, avoiding = _avoidance(scenario, at)
    near: dict[str, Any] = {"repulsion_within": scenario.avoidance.end_effector} if isinstance(
        scenario.avoidance, AvoidanceSection) else {}
    # Algorithm 1 adds the cone's surface to the stack while it is violated: an equality.
    surface: dict[str, Any] = {"kind": "equality"} if scenario.control.stack == "switched" else {}
    position: kinds.Position | None = _made(scenario.position, at, **near)
    pointing: kinds.Pointing | None = _made(scenario.pointing, at, **surface)
    posture = _made(scenario.posture, at)
    # The separation from obstacles stands where the task "collision" is listed.
    collision = any(task.kind == "collision" for task in scenario.tasks)
    moved = [task for task in avoiding if collision and isinstance(task, kinds.Separation)]
    of_section = [(section, moved if section.kind == "collision" else [
        _made(section, at, f"tasks.{i}")]) for i, section in enumerate(scenario.tasks)]
    listed = [task for _, made in of_section for task in made]
    tasks = [*first, *(task for task in avoiding if task not in moved),
             *(task for task in (position, pointing, *listed, posture if last else None) if task)]
    for wrong in alike(task.name for task in tasks):  # with levels that no section names
        raise ScenarioError(f"scenario {scenario.name!r}: {wrong}")
    reference = _reference(scenario, at, None if last else posture)
    frozen = scenario.control.stack == "set-based"  # inequalities, which then use no gain or rate
    for task in (*tasks, *((reference,) if reference else ())):
        if not (frozen and task.kind == "inequality"):
            check_period(task, scenario.control.period, scenario.control.level)
    return Tasks(tasks, position, pointing, limits,
                 tuple(task for task in listed if task not in moved), areas,
                 reference, {task.name: section.give for section, made in of_section
                             for task in made if section.give})


def _first(scenario: Scenario, at: References) -> tuple[kinds.JointLimits | None, list[Task]]:
    """Return the joint limits, and all tasks at the top: mechanism, physics, limits."""
    section, control, first = scenario.limits, scenario.control, list[Task]()
    bounded = section is not None and section.place == "bounds"
    with naming("limits"):
        limits = None if section is None else _joint_limits(section, control, at.robot)
        if section and limits and scenario.limits_in_stack:
            first.append(limits if section.danger_reach is None else kinds.DangerBounds(
                limits, sensed_points(at.robot), section.danger_reach, name=limits.name))
            if section.torque and not bounded and control.level != "torque":  # see `_physics`
                first.append(kinds.TorqueLimits(at.robot, section.torque))
    if at.contacts is not None:
        physics = _physics(scenario, at.contacts)
        first = [*first, *physics] if bounded else [*physics, *first]
    return limits, above(model_rows(at.robot, control.period), first,
                         not bounded and scenario.make_resolver().can_resolve("inequalities"))


def _joint_limits(section: LimitsSection, control: ControlSection,
                  robot: Robot) -> kinds.JointLimits:
    """Return the limits of the joints, and of a floating base unless only forces move it."""
    speed = section.base_speed
    if speed is None and robot.base == "floating" and control.level != "torque":
        speed = float(robot.velocity_limit[0]), float(robot.velocity_limit[3])
    horizon = section.horizon
    if horizon is None:
        horizon = 0.05 if control.level == "torque" else 0.0
    return kinds.JointLimits(robot, section.acceleration, control.period, section.margin,
                             base_speed=speed, base_acceleration=section.base_acceleration,
                             horizon=horizon)


def _avoidance(scenario: Scenario,
               at: References) -> tuple[SurveillanceAreas | None, list[Task]]:
    """Return the areas of Algorithm 1 if it places avoidance, and the tasks that avoid."""
    section, tasks = scenario.avoidance, list[Task]()
    if isinstance(section, AvoidanceSection) and section.place == "stack":
        kind = PublishedAvoidance if section.jacobian == "published" else kinds.Avoidance
        return (SurveillanceAreas(section.near, section.far, section.end_effector),
                [kind(at.robot.control_points, section.dimension)])
    if isinstance(section, SeparationSection):
        count = len(section.obstacles) if scenario.sensor.kind == "exact" else None
        if count != 0:
            tasks.append(kinds.Separation(sensed_points(at.robot),
                                          section.barrier(section.distance), count))
        if (distance := section.self_collision) is not None:
            with naming("avoidance.self_collision"):
                tasks.append(kinds.SelfSeparation(at.robot.capsules, section.barrier(distance),
                                                  at.pairs(distance)))
    return None, tasks


def _reference(scenario: Scenario, at: References, posture: Task | None) -> Task | None:
    """Return the null-space task: [damping] or a posture, and the body's repulsion if placed so."""
    base = posture if scenario.damping is None else kinds.JointDamping(
        at.robot.n, scenario.damping.value, scenario.damping.weight)
    avoidance, points = scenario.avoidance, at.robot.control_points
    if not isinstance(avoidance, AvoidanceSection) or avoidance.place == "stack" or not points:
        return base
    return kinds.CumulatedRepulsion(at.robot.n, points, avoidance.far, base)


def _made(section: Made | None, at: References, key: str = "", /, **more: Any) -> Any:
    """Make a task; raises ScenarioError, naming its key, where it does not fit the robot."""
    if section is None:
        return None
    with naming(key or section.title):
        return section.make(at, **more)


def _physics(scenario: Scenario, contacts: Contacts) -> list[Task]:
    """Return the levels at the top of a stack at level "torque".

    "physics" has the equations of motion of a floating base and the contacts at rest, "limits" the
    torque limits and the forces that contacts can transmit, the last the largest change of a
    torque. One that would be empty is left out.
    """
    robot, limits, forces = contacts.robot, scenario.limits, scenario.forces
    physics, bounds = list[Task](), list[Task]()
    with naming("forces"):
        if robot.base == "floating":
            physics.append(kinds.BaseDynamics(contacts))
        if contacts.contacts:
            physics.append(kinds.ContactMotion(contacts, damping=forces.damping))
        if scenario.forces_in_stack:
            if limits and limits.torque:
                bounds.append(kinds.TorqueLimits(robot, limits.torque, contacts=contacts))
            if contacts.contacts:
                bounds.append(kinds.Friction(contacts, forces.faces, forces.least,
                                             forces.largest or inf))
            if forces.edge is not None:
                bounds.append(kinds.CentreOfPressure(contacts, forces.edge))
    levels: list[Task] = [kinds.Together(tasks, name) for tasks, name in (
        (physics, "physics"), (bounds, "limits")) if tasks]
    if scenario.forces_in_stack and limits and limits.torque_step:
        levels.append(kinds.TorqueStep(robot, limits.torque_step, contacts=contacts))
    return levels
