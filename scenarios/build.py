"""From a scenario file to the parts of its control loop."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians

import numpy as np

from hierarchy import HierarchyError, Robot, Stack, State, Task
from hierarchy.avoidance import (
    Barrier,
    ControlPoint,
    Obstacle,
    Obstacles,
    Repulsion,
    SurveillanceAreas,
)
from hierarchy.paths import Shifted, Still
from hierarchy.problem import Array
from hierarchy.tasks import (
    Avoidance,
    DangerBounds,
    JointDamping,
    JointLimits,
    Pointing,
    Position,
    Posture,
    Separation,
    TorqueLimits,
)
from hierarchy.tasks.self_separation import SelfSeparation
from scenarios.config import Scenario, ScenarioError
from scenarios.config.avoidance import (
    AvoidanceSection,
    ObstacleSection,
    RepulsionSection,
    SeparationSection,
)
from scenarios.config.robot import StartSection
from scenarios.control.order import Hierarchical, Order, Switched
from scenarios.making import (
    make_path,
    make_robot,
    make_tasks,
    separable_pairs,
    start_state,
)
from scenarios.plants import Apart, Commanded, JointSensor, KinematicArm, PhysicsArm, Plant
from scenarios.published import PublishedAvoidance
from scenarios.sensors import ExactDistances, Sensor
from scenarios.sensors.making import make_depth_sensor
from solvers import make

__all__ = ["Cell", "build", "make_obstacles", "make_path", "make_robot", "sensed_points"]


@dataclass(frozen=True)
class Cell:
    """A robot with its start, its tasks and what it senses: everything the loop needs.

    `order` says which tasks are in the stack, from the measurement and the cone error. `position`,
    `pointing`, `limits` are the tasks of that name or None, `listed` those of `[[tasks]]`; `areas`
    are those of Algorithm 1.
    """

    scenario: Scenario
    robot: Robot
    state: State
    plant: Plant
    stack: Stack
    sensor: Sensor | None
    areas: SurveillanceAreas | None
    position: Position | None
    pointing: Pointing | None
    limits: JointLimits | None
    order: Order
    listed: tuple[Task, ...] = ()


def build(scenario: Scenario, kept: Cell | None = None) -> Cell:
    """Make the parts; raises HierarchyError where the scenario does not fit its robot.

    With `kept`, the cell of a scenario that differs in its tasks' settings or its resolver, its
    robot, state, plant and obstacles go on, and its sensor where the settings of that are the same.
    """
    robot = kept.robot if kept else make_robot(scenario.robot)
    control, avoidance = scenario.control, scenario.avoidance
    differences = control.period if control.jacobian_derivative == "difference" else None
    state = kept.state if kept else State(robot, differences)
    sensor = _kept_sensor(scenario, kept) if kept else _sensor(scenario, robot)
    obstacles = sensor.obstacles if sensor else Obstacles()
    plant = kept.plant if kept else _started_plant(scenario, robot, sensor, obstacles)
    limits, first = _limits(scenario, robot)
    position, pointing = _position(scenario, robot), _pointing(scenario, robot)
    listed, last = _listed(scenario, robot), _posture(scenario, robot, "task")
    tasks = [*first, *_avoidance(scenario, robot),
             *(task for task in (position, pointing, *listed, last) if task)]
    areas = (SurveillanceAreas(avoidance.near, avoidance.far, avoidance.end_effector)
             if isinstance(avoidance, AvoidanceSection) else None)
    return Cell(scenario, robot, state, plant,
                Stack(tasks, control.level, _reference(scenario, robot)), sensor, areas,
                position, pointing, limits, _order(scenario, areas, first, tasks), tuple(listed))


def sensed_points(robot: Robot) -> tuple[ControlPoint, ...]:
    """Return what a sensor measures: the control points, and the end effector as the last."""
    end = robot.frame(robot.end_effector)
    return (*robot.control_points, ControlPoint(end.name, end.joint, end.offset))


def make_obstacles(sections: tuple[ObstacleSection, ...]) -> Obstacles:
    """Make the scene's obstacles, numbered from 1 in messages."""
    return Obstacles([_obstacle(i, section) for i, section in enumerate(sections, 1)])


def _obstacle(number: int, section: ObstacleSection) -> Obstacle:
    path = None if section.path is None else make_path(section.path)
    size = {"point": (), "sphere": (section.radius,),
            "capsule": (section.radius, section.half_length),
            "box": section.half_lengths}[section.shape]
    return Obstacle(section.shape, section.centre or (0.0, 0.0, 0.0),
                    tuple(float(s) for s in size or () if s is not None),
                    np.array(section.rotation), path, f"obstacle {number}")


def _start(robot: Robot, section: StartSection) -> tuple[Array, Array]:
    state = start_state(robot, section)
    if section.end_effector is None:
        return state.q.copy(), state.v.copy()
    return _reach(robot, state.q.copy(), np.array(section.end_effector)), state.v.copy()


_REACHED = 1e-6      # [m]
_REACH_STEPS = 500   # damped Newton steps; a reachable point takes some ten
_LONGEST_STEP = 0.3  # [rad] of any joint


def _reach(robot: Robot, q: Array, point: Array) -> Array:
    """Bring the end effector to a point [m] from q, or raise a ScenarioError."""
    frame, resolver = robot.frame(robot.end_effector), make("tpm", damping=0.05)
    stack = Stack([Position(frame, Still(point.tolist()), gain=1.0)], "velocity")
    nearest = np.inf
    for _ in range(_REACH_STEPS):
        state = robot.state(q)
        distance = float(np.linalg.norm(state.position(frame) - point))
        nearest = min(nearest, distance)
        if distance < _REACHED:
            return q
        step = resolver.solve(stack.hierarchy(state)).x
        step = step * min(1.0, _LONGEST_STEP / max(float(np.abs(step).max()), 1e-12))
        q = robot.integrate(q, step)
    raise ScenarioError(f"start.end_effector {point.tolist()} m cannot be reached: robot "
                        f"{robot.name!r} came no nearer than {nearest:.3g} m")


def _started_plant(scenario: Scenario, robot: Robot, sensor: Sensor | None,
                   obstacles: Obstacles) -> Plant:
    q, v = _start(robot, scenario.start)
    if sensor is not None:
        sensor.check_start(robot.state(q, v))
    return _plant(scenario, robot, q, v, obstacles)


def _plant(scenario: Scenario, robot: Robot, q: Array, v: Array, obstacles: Obstacles) -> Plant:
    section, control = scenario.plant, scenario.control
    if not section.measurement.ideal and robot.nq != robot.n:
        raise ScenarioError(f"plant.measurement: robot {robot.name!r} has joints with more "
                            "coordinates than velocities, which have no noise, steps or delay")
    sensor = JointSensor(section.measurement, control.period)
    if section.kind == "mujoco":
        arm = PhysicsArm(robot, q, v, control.period, control.level, obstacles, section.servo,
                         section.joints)
        return Apart(arm, Commanded(arm) if section.feedback == "commanded" else sensor)
    exact = KinematicArm(robot, q, v, control.period, control.level)
    ideal = section.measurement.ideal or section.feedback == "commanded"
    return exact if ideal else Apart(exact, sensor)


def _kept_sensor(scenario: Scenario, kept: Cell) -> Sensor | None:
    same = (scenario.avoidance, scenario.sensor, scenario.limits) == (
        kept.scenario.avoidance, kept.scenario.sensor, kept.scenario.limits)
    if same or kept.sensor is None:
        return kept.sensor
    return _sensor(scenario, kept.robot, kept.sensor.obstacles)


def _sensor(scenario: Scenario, robot: Robot,
            obstacles: Obstacles | None = None) -> Sensor | None:
    section = scenario.avoidance
    if section is None:
        return None
    if not robot.control_points:
        raise ScenarioError(f"[avoidance]: robot {robot.name!r} has no control points; list them "
                            "in robot.control_points")
    if obstacles is None:
        obstacles = make_obstacles(section.placed)
    if isinstance(section, SeparationSection):
        return _seen_by(scenario, robot, ExactDistances(robot, obstacles, pairs=True),
                        section.influence)
    mean = section.direction == "mean"
    body, tip = _law(section.body), _law(section.tip)
    exact = ExactDistances(robot, obstacles, body, tip, section.far if mean else 0.0)
    return _seen_by(scenario, robot, exact, max(section.far, section.end_effector), mean, body, tip)


def _seen_by(scenario: Scenario, robot: Robot, exact: ExactDistances, region: float,
             mean: bool = False, body: Repulsion | None = None,
             tip: Repulsion | None = None) -> Sensor:
    """The sensor that the scenario asks for, in place of an exact one."""
    if scenario.sensor.kind == "exact":
        return exact
    danger = scenario.limits.danger_reach if scenario.limits else None
    try:
        return make_depth_sensor(scenario.sensor, robot, exact, max(region, danger or 0.0), mean,
                                 body, tip)
    except HierarchyError as error:
        raise ScenarioError(f"sensor: {error}") from error


def _law(section: RepulsionSection) -> Repulsion:
    return Repulsion(section.maximum, section.reach, section.shape, section.scale)


def _position(scenario: Scenario, robot: Robot) -> Position | None:
    section = scenario.position
    if section is None:
        return None
    avoidance = scenario.avoidance
    within = avoidance.end_effector if isinstance(avoidance, AvoidanceSection) else -1.0
    path = make_path(section.path)
    return Position(robot.frame(robot.end_effector),
                    Shifted(path, section.offset) if any(section.offset) else path,
                    section.stiffness, section.damping, section.gain, repulsion_within=within)


def _pointing(scenario: Scenario, robot: Robot) -> Pointing | None:
    section = scenario.pointing
    if section is None:
        return None
    # Algorithm 1 puts the cone's surface into the stack while it is violated: an equality.
    kind = section.kind if scenario.control.stack == "hierarchical" else "equality"
    return Pointing(robot.frame(robot.end_effector), section.axis, radians(section.alpha_d),
                    kind, section.stiffness, section.damping, section.gain)


def _listed(scenario: Scenario, robot: Robot) -> list[Task]:
    """The tasks of `[[tasks]]`, with what they leave open as it is at the start."""
    if not scenario.tasks:
        return []
    return make_tasks(scenario.tasks, robot.state(*_start(robot, scenario.start)))


def _limits(scenario: Scenario, robot: Robot) -> tuple[JointLimits | None, list[Task]]:
    """The joint limits, and the tasks that go first."""
    section = scenario.limits
    if section is None:
        return None, []
    try:
        limits = JointLimits(robot, section.acceleration, scenario.control.period, section.margin)
        box = limits if section.danger_reach is None else DangerBounds(
            limits, sensed_points(robot), section.danger_reach, name=limits.name)
        if not scenario.limits_in_stack:
            return limits, []
        torque = [] if section.torque is None else [TorqueLimits(robot, section.torque)]
    except HierarchyError as error:
        raise ScenarioError(f"limits: {error}") from error
    return limits, [box, *torque]


def _avoidance(scenario: Scenario, robot: Robot) -> list[Task]:
    section = scenario.avoidance
    if section is None:
        return []
    if isinstance(section, SeparationSection):
        return _separation(section, robot, scenario.sensor.kind == "exact")
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
        pairs = separable_pairs(robot)
        if not pairs:
            raise ScenarioError(f"avoidance.self_collision: robot {robot.name!r} has no capsules "
                                "that could be kept apart; list them in robot.capsules")
        barrier = Barrier(section.self_collision, section.rate, section.influence,
                          section.recovery, section.limit)
        tasks.append(SelfSeparation(robot.capsules, barrier, pairs))
    return tasks


def _order(scenario: Scenario, areas: SurveillanceAreas | None, first: list[Task],
           tasks: list[Task]) -> Order:
    if scenario.control.stack == "hierarchical":
        return Hierarchical([task.name for task in tasks])
    always_point = bool(scenario.pointing and scenario.pointing.kind == "equality")
    return Switched(areas, always_point, [task.name for task in first],
                    scenario.position is not None)


def _reference(scenario: Scenario, robot: Robot) -> Task | None:
    if scenario.damping is not None:
        return JointDamping(robot.n, scenario.damping.value, scenario.damping.weight)
    return _posture(scenario, robot, "null-space")


def _posture(scenario: Scenario, robot: Robot, role: str) -> Posture | None:
    section = scenario.posture
    if section is None or section.role != role:
        return None
    joints = robot.n - robot.actuated
    if len(section.target) != joints:
        raise ScenarioError(f"posture.target has {len(section.target)} entries, robot "
                            f"{robot.name!r} has {joints} joints")
    return Posture(section.target, section.stiffness, section.damping, section.gain)
