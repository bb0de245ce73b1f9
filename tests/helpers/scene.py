"""A KUKA LWR among obstacles, for tests of tasks and stacks."""

import numpy as np

from hierarchy import Robot, State, Task, tasks
from hierarchy.avoidance import Obstacle, Obstacles, Pairs, Repulsion, measure_pairs
from hierarchy.paths import Ellipse, Still
from hierarchy.task import Rows
from scenarios.cell.sensors import ExactDistances

ROBOT = Robot.named("kuka_lwr")
FRAME = ROBOT.frame("end_effector")
PATH = Ellipse((0.0, 0.6, 0.0), (0.2, 0.0, 0.2), (0.0, 0.1, 0.0), rate=1.3)
OBSTACLES = Obstacles([
    Obstacle("point", (0.1, 0.5, 0.1)), Obstacle("box", (-0.2, 0.3, 0.2), (0.1, 0.02, 0.03)),
    Obstacle("capsule", (-0.1, 0.4, -0.1), (0.02, 0.1))])
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])  # of an obstacle
BODY, TIP = Repulsion(0.15, 0.15, 2.0, 3.0), Repulsion(5.0, 0.1, 10.0, 1.5)
SENSOR = ExactDistances(ROBOT, OBSTACLES, BODY, TIP, pairs=True)

TASKS = {
    "position": tasks.Position(FRAME, PATH, repulsion_within=0.5),
    "along": tasks.Along(tasks.Position(FRAME, PATH), ((0.6, 0.0, 0.8), (0.0, 1.0, 0.0))),
    "pointing": tasks.Pointing(FRAME, (1.0, 0.2, 0.0), 0.3),
    "cone": tasks.Pointing(FRAME, (1.0, 0.2, 0.0), 0.3, "inequality"),
    **{f"avoidance {rows}-D": tasks.Avoidance(ROBOT.control_points, rows) for rows in (1, 3)},
    "pose": tasks.Pose(FRAME, PATH, np.eye(3)), "look-at": tasks.LookAt(FRAME, (0.3, 0.9, 1.4)),
    "orientation": tasks.Orientation(FRAME, np.eye(3)[[1, 2, 0]]),
    "frame": tasks.FrameLog(FRAME, Still((0.1, 0.5, 0.1)), np.eye(3)[[1, 2, 0]]),
    "centre of mass": tasks.CentreOfMass(ROBOT, PATH),
    "centre of mass, x and z": tasks.CentreOfMass(ROBOT, PATH, (0, 2)),
    "momentum": tasks.Momentum(),
    "posture": tasks.Posture((0.1,) * 7), "damping": tasks.JointDamping(7),
    "relative pose": tasks.RelativePose(FRAME, ROBOT.frame("joint_3"), (0.1, 0.2, 0.3),
                                  np.eye(3)[[1, 2, 0]]),
    "relative position": tasks.RelativePose(FRAME, ROBOT.frame("joint_3"), (0.1, 0.2, 0.3)),
    "coupling": tasks.JointCoupling(ROBOT, {"joint_2": 1.0, "joint_5": -0.5}, 0.3),
    "manipulability": tasks.Manipulability(ROBOT.frame("joint_6"), 0.1),
    "manipulability of the pose": tasks.Manipulability(FRAME, 0.1, "pose", "equality")}


def states(count, seed=1):
    """Random (q, v) within the joint limits."""
    rng = np.random.default_rng(seed)
    return [(rng.uniform(0.9 * ROBOT.lower, 0.9 * ROBOT.upper), rng.normal(size=7))
            for _ in range(count)]


def state_at(q, v, t=0.7, differences=None):
    """A State that carries a measurement of its own moment."""
    state = State.at(ROBOT, q, v, t, differences)
    SENSOR.measure(state)
    return state


def place_of(point, q):
    """Where a control point is at q, independent of the Jacobians."""
    rotation, translation = State.at(ROBOT, q)._placement(point.joint)
    return translation + rotation @ point.offset


def compiled_rows(task, state, level, rtol=1e-12):
    """The rows that a task writes (A, lower, upper), checked against those of its plain methods."""
    count = task.dimension + 2
    written, plain = [Rows(np.full((count, state.n), 5.0), np.full(count, 5.0),
                           np.full(count, 5.0)) for _ in range(2)]
    task.writer(state, level, written.split([1, task.dimension])[1])()
    Task.writer(task, state, level, plain.split([1, task.dimension])[1])()
    for a, b in zip(written, plain, strict=True):
        np.testing.assert_allclose(a, b, rtol=rtol, atol=1e-9)  # dJ by differences
        assert (a[[0, -1]] == 5.0).all(), "rows of others are left alone"
    return [a[1:-1] for a in written]


def distance(obstacle, point):
    """Signed distance of a point to an obstacle, and the direction away from it (3,)."""
    pairs = Pairs(1, 1)
    measure_pairs(pairs, np.array([point]), Obstacles([obstacle]))
    return pairs.distance[0, 0], pairs.direction[0, 0]


def deproject(pinhole, pixels):
    """World points (..., 3) [m] of u, v [px] and depth [m] (..., 3)."""
    u, v, depth = np.moveaxis(np.asarray(pixels, dtype=float), -1, 0)
    seen = [(u - pinhole.cx) / pinhole.fx * depth, (v - pinhole.cy) / pinhole.fy * depth, depth]
    return np.stack(seen, axis=-1) @ np.asarray(pinhole.rotation).T + np.asarray(pinhole.position)


def resting(place, frame=FRAME, **settings):
    """A task: a frame is to be where it then rests."""
    return tasks.Position(frame, Still(place), **settings)


def of_user(name, dimension, error, jacobian, **more):
    """A task that a user writes: its error and rows as functions of a state, other attributes."""
    given = {"error": error, "jacobian": jacobian, "jacobian_derivative": jacobian}
    methods = {key: lambda self, state, of=of: of(state) for key, of in given.items()}
    return type("OfUser", (Task,), {"name": name, "dimension": dimension, **methods, **more})()
