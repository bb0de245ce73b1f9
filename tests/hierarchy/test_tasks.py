"""Tasks: rows, errors and their derivatives, by differences; stacks of them."""

import copy
import pickle
from dataclasses import fields, replace

import numpy as np
import pinocchio as pin
import pytest
from refusals import refused
from scene import FRAME, PATH, ROBOT, TASKS, compiled_rows, of_user, place_of, state_at, states
from scipy.linalg import expm
from urdf_text import LIMIT, joint, link, loaded, placed

from hierarchy import Stack, State, tasks
from hierarchy.activation import Activation
from hierarchy.avoidance import Barrier, Measurement, Pairs
from hierarchy.kinematics import cross, rotation_vector
from hierarchy.paths import Ellipse, Still
from hierarchy.robot import Frame

STEP = 1e-6
STATES = states(11)


def moved(q, v, step, task_state):
    """The state a little later along v, with the measurement of `task_state`."""
    state = State.at(ROBOT, q + step * v, v, task_state.t)
    state.measurement = task_state.measurement
    return state


@pytest.mark.parametrize("name", ["position", "pointing", "cone", "posture", "centre of mass",
                                  "centre of mass, x and z", "frame", "relative position",
                                  "coupling", "look-at", "manipulability",
                                  "manipulability of the pose"])
def test_jacobian_is_the_derivative_of_what_the_error_measures(name):
    task = TASKS[name]
    for q, v in STATES:
        state = state_at(q, v)
        columns = [(task.error(moved(q, e, -STEP, state)) - task.error(moved(q, e, STEP, state)))
                   / (2 * STEP) for e in np.eye(7)]
        np.testing.assert_allclose(np.transpose(columns), task.jacobian(state), atol=1e-9)


def test_a_row_that_only_the_decimals_of_a_file_fill_is_zero(tmp_path):
    turned = placed("0 0 0", "1.57079632679 0 0")
    robot = loaded(tmp_path, *map(link, "abc"),
                   joint("j", "revolute", "a", "b", LIMIT, "0 0 1", turned),
                   joint("k", "fixed", "b", "c", "", "", placed("1 0 0")))
    state, tip = State.at(robot, [0.0]), robot.frame("c")
    for task in (tasks.Position(tip, PATH), tasks.Pose(tip, PATH, np.eye(3))):
        np.testing.assert_array_equal(task.jacobian(state)[:2], 0.0)


@pytest.mark.parametrize("rows", [1, 3])
def test_avoidance_jacobian_is_that_of_the_active_control_point(rows):
    task = TASKS[f"avoidance {rows}-D"]
    for q, v in STATES:
        state = state_at(q, v)
        seen = state.measurement
        point = ROBOT.control_points[seen.active]
        away = seen.direction[seen.active].copy()
        J = np.transpose([place_of(point, q + STEP * e) - place_of(point, q - STEP * e)
                          for e in np.eye(7)]) / (2 * STEP)
        np.testing.assert_allclose(task.jacobian(state), J if rows == 3 else away[None] @ J,
                                   atol=1e-9)


@pytest.mark.parametrize("name", [name for name in TASKS if name != "damping"])
def test_jacobian_derivative_agrees_with_central_differences(name):
    task = TASKS[name]
    for q, v in STATES:
        state = state_at(q, v)
        later, before = moved(q, v, STEP, state), moved(q, v, -STEP, state)
        difference = (task.jacobian(later) - task.jacobian(before)) / (2 * STEP)
        # Second derivatives are large near a singularity and behind: the differences round.
        rtol, atol = (1e-5, 1e-8) if name.startswith(("manip", "look")) else (1e-7, 3e-9)
        np.testing.assert_allclose(task.jacobian_derivative(state), difference, rtol, atol)


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("differences", [None, 1e-3])
@pytest.mark.parametrize("name", TASKS)
def test_compiled_rows_equal_those_of_the_plain_methods(name, level, differences):
    task = TASKS[name]
    for q, v in STATES[:5]:
        state = state_at(q, v, differences=differences)
        state.move(0.8, q + 1e-3 * v, v)
        compiled_rows(task, state, level)


@pytest.mark.parametrize("name", ["pose", "relative pose"])
def test_kernels_get_rotations_row_by_row(name):
    """Pinocchio's are column by column: kernels were compiled for them, for 13 s, within a loop."""
    here = pin.SE3(np.eye(3)[[1, 2, 0]], np.array([0.1, 0.5, 0.1]))
    tool = Frame("tool", FRAME.joint, here.translation, here.rotation)
    read = replace(TASKS[name], frame=tool, rotation=here.rotation).measure(State(ROBOT))[1]
    arrays = [part for part in (*read, *read[0]) if isinstance(part, np.ndarray)]
    assert not here.rotation.flags.c_contiguous
    assert all(array.flags.c_contiguous for array in arrays)


@pytest.mark.parametrize("angle", [0.0, 1e-9, 0.5, 3.0, np.pi - 1e-9, np.pi])
def test_rotation_vector_inverts_rodrigues(angle):
    axis = np.array([0.6, -0.48, 0.64])
    K = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    vector = rotation_vector(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)
    if angle > 3.1:  # both signs of the axis describe half a turn
        vector = vector * np.sign(vector @ axis)
    np.testing.assert_allclose(vector, angle * axis, atol=1e-8)


def test_the_error_of_a_frame_is_the_logarithm_of_its_pose_to_the_target():
    for q, _ in STATES:
        state, task = State.at(ROBOT, q), TASKS["frame"]
        here = pin.SE3(state.rotation(FRAME), state.position(FRAME))
        there = pin.SE3(task.rotation, task.path(0.0)[0])
        np.testing.assert_allclose(pin.exp6(task.error(state)), here.inverse() * there, atol=1e-12)


@pytest.mark.parametrize("angle", [1e-6, 0.0999, 0.1001, 1.0, 3.0])
def test_rates_of_a_frame_that_follows_a_path_are_the_derivatives_of_its_error(angle):
    h, (q, v) = 1e-4, STATES[4]
    a, start = np.arange(7.0) - 3.0, State.at(ROBOT, q)
    task = tasks.FrameLog(FRAME, Ellipse(start.position(FRAME), (0.2, 0.0, 0.1), (0.0, 0.2, 0.1)),
                    start.rotation(FRAME) @ expm(angle * cross(np.array([0.6, 0.0, 0.8]))))

    def error(t):
        return task.error(State.at(ROBOT, q + v * t + a * t * t / 2, t=t))

    state = State.at(ROBOT, q, v)
    J, dJ = task.jacobian(state), task.jacobian_derivative(state)
    rate = task.desired_velocity(state) - J @ v
    bend = task.desired_acceleration(state) - J @ a - dJ @ v
    np.testing.assert_allclose(rate, (error(h) - error(-h)) / (2 * h), rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(bend, (error(h) - 2 * error(0.0) + error(-h)) / h**2,
                               rtol=1e-5, atol=1e-5)


def test_a_task_made_of_others_has_the_feedforward_of_their_paths():
    """Its desired acceleration was zero."""
    state, task, along = state_at(*STATES[0]), TASKS["position"], TASKS["along"]
    both = tasks.Together([task, TASKS["posture"]])
    for wanted in ("desired_velocity", "desired_acceleration"):
        found = getattr(task, wanted)(state)
        assert np.linalg.norm(found) > 0.01
        np.testing.assert_allclose(getattr(along, wanted)(state), along.directions @ found)
        np.testing.assert_allclose(getattr(both, wanted)(state), [*found, *np.zeros(7)])


def test_a_target_however_far_is_looked_at_as_a_direction():
    """Squares of its position overflowed: the error was zero, and the rows NaN."""
    near, far = (tasks.LookAt(FRAME, (size, -size, 0.3)) for size in (1e50, 1e300))
    state = state_at(Q, V)
    np.testing.assert_allclose(far.error(state), near.error(state))
    for rows in ("jacobian", "jacobian_derivative"):
        np.testing.assert_allclose(getattr(far, rows)(state), getattr(near, rows)(state),
                                   atol=1e-12)


@pytest.mark.parametrize(("kind", "given", "other"), [
    (tasks.LookAt, {"target": np.array([0.3, 0.5, 0.1])}, [0.1, -0.4, 0.2]),
    (lambda frame, goal: tasks.Position(frame, Still(goal)), {"goal": np.zeros(3)}, [1, 2, 3]),
    (tasks.Pose, {"path": PATH, "rotation": np.eye(3)}, np.diag([1.0, -1.0, -1.0])),
    (tasks.FrameLog, {"path": PATH, "rotation": np.eye(3)}, np.diag([-1.0, 1.0, -1.0])),
    (tasks.Orientation, {"rotation": np.eye(3)}, np.diag([-1.0, 1.0, -1.0])),
    (lambda _, target: tasks.Posture(target), {"target": np.full(7, 0.3)}, STATES[1][0])])
def test_what_is_written_into_the_array_of_a_target_moves_it_in_a_stack_too(kind, given, other):
    state, key = State.at(ROBOT, *STATES[0]), [*given][-1]
    stack = Stack([kind(FRAME, **given)], "velocity")
    stack.hierarchy(state)
    given[key][:] = other
    fresh = Stack([kind(FRAME, **{**given, key: np.array(other)})], "velocity")
    np.testing.assert_array_equal(stack.hierarchy(state).lower, fresh.hierarchy(state).lower)


@pytest.mark.parametrize("task", [
    *TASKS.values(), tasks.JointLimits(ROBOT, 10.0, 1e-3), tasks.TorqueLimits(ROBOT),
    tasks.DangerBounds(tasks.JointLimits(ROBOT, 10.0, 1e-3), ROBOT.control_points),
    tasks.TorqueStep(ROBOT, 1.0), tasks.Separation(ROBOT.control_points, Barrier(0.05)),
    tasks.SelfSeparation(ROBOT.capsules, Barrier(0.05))],
    ids=lambda task: task.name)
def test_tasks_of_the_same_settings_are_equal_and_print_their_settings_alone(task):
    assert replace(task) == task
    assert replace(task, name="another") != task
    for field in fields(task):
        if field.init and isinstance(array := getattr(task, field.name), np.ndarray):
            assert replace(task, **{field.name: array.copy()}) == task
            assert replace(task, **{field.name: -array[::-1]}) != task
        assert (f" {field.name}=" in f" {repr(task).partition('(')[2]}") == field.init


def test_a_number_for_the_only_row_of_a_users_task_serves_together_with_others():
    first = of_user("first", 1, lambda state: 0.3 - state.q[0], lambda state: np.eye(1, state.n),
                    desired_velocity=lambda self, state: 0.1)
    state, whole = State.at(ROBOT, ROBOT.rest), tasks.Together([first, tasks.Posture([0.5] * 7)])
    np.testing.assert_array_equal(whole.error(state), [0.3, *[0.5] * 7])
    np.testing.assert_array_equal(whole.desired_velocity(state), [0.1, *[0.0] * 7])
    np.testing.assert_allclose(Activation(state, [first], {"first": 0.6})(), [0.5])


def test_frames_and_points_are_compared_by_their_numbers():
    points = [replace(point, offset=point.offset.copy()) for point in ROBOT.control_points]
    assert tasks.Avoidance(points) == tasks.Avoidance(list(ROBOT.control_points))
    assert tasks.Avoidance(points) != tasks.Avoidance(points[::-1])
    assert ROBOT.frame("end_effector") == FRAME != ROBOT.frame("joint_3")


def test_manipulability_is_yoshikawas_and_has_no_row_at_a_singular_posture():
    task, state = TASKS["manipulability"], state_at(*STATES[4])
    J = np.array(tasks.Position(task.frame, PATH).jacobian(state))
    assert task.value(state) == pytest.approx(np.sqrt(np.linalg.det(J @ J.T)), rel=1e-9)
    straight = State.at(ROBOT, np.zeros(7))
    assert task.value(straight) < 1e-12
    assert not np.any([task.jacobian(straight), task.jacobian_derivative(straight)])


Q, V = states(1)[0]


def stack(level="acceleration", **kwargs):
    return Stack([TASKS["position"], TASKS["pointing"], TASKS["avoidance 3-D"]], level, **kwargs)


def test_insert_remove_swap_and_reorder_by_name():
    s = stack()
    s.insert(TASKS["posture"], 1)
    assert s.names == ("position", "posture", "pointing", "avoidance")
    s.swap("position", "avoidance")
    assert s.names == ("avoidance", "posture", "pointing", "position")
    assert s.remove("posture") is TASKS["posture"]
    s.reorder(["pointing", "position", "avoidance"])
    assert (s.names, len(s)) == (("pointing", "position", "avoidance"), 3)


def test_rows_are_those_of_the_tasks_named_in_order_and_written_into_the_same_buffers():
    s = Stack([TASKS["position"], tasks.LookAt(FRAME, (0.3, 0.3, 0.6))])
    assert (s.row_names(), s.row_names(("look-at",))) == (("x", "y", "z", "x", "y"), ("x", "y"))
    along = tasks.Along(TASKS["position"], [[0, 0, 1], [0.6, 0.8, 0]])
    assert along.row_names == ("z", "along [0.6, 0.8, 0.0]")
    assert TASKS["centre of mass, x and z"].row_names == ("x", "z")
    state = state_at(Q, V)
    h = stack().hierarchy(state, ("avoidance", "position"))
    assert (h.names, h.sizes.tolist()) == (("avoidance", "position"), [3, 3])
    np.testing.assert_array_equal(h.A[:3], TASKS["avoidance 3-D"].jacobian(state))
    np.testing.assert_array_equal(h.A[3:], TASKS["position"].jacobian(state))
    assert h.is_equality
    assert stack().hierarchy(state, ()).m == 0, "an empty order is no error"
    s, state = stack(), state_at(Q, V)
    first = s.hierarchy(state)
    A = first.A.copy()
    state.move(0.0, Q + 0.1, V)
    assert s.hierarchy(state) is first
    assert not np.array_equal(first.A, A)


@pytest.mark.parametrize(("array", "value"), [
    ("A", np.ones((7, 7))), ("lower", np.full(7, -np.inf)), ("upper", np.full(7, np.inf)),
    ("reference", np.ones(7)), ("metric", 2.0 * np.eye(7)), ("give", np.ones(7))])
def test_an_array_that_is_set_in_the_hierarchy_of_a_stack_stays_in_that_one(array, value):
    s, state = stack(), state_at(Q, V)
    setattr(s.hierarchy(state), array, value)
    state.move(0.0, Q + 0.1, V)
    for _ in range(2):
        h, fresh = s.hierarchy(state), stack().hierarchy(state)
        for one in ("A", "lower", "upper", "reference", "metric", "give"):
            np.testing.assert_array_equal(getattr(h, one), getattr(fresh, one))


COPIES = pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy,
                                            lambda one: pickle.loads(pickle.dumps(one))])


@COPIES
@pytest.mark.parametrize("differences", [None, 0.01])
def test_a_copy_of_a_state_goes_on_from_there_with_memory_of_its_own(differences, copied):
    state = State.at(ROBOT, Q, V, differences=differences)
    state.move(0.01, Q + 0.01, V)
    state.measurement, state.commanded = Measurement(1), V
    state.measurement.pairs = Pairs(1, 1)
    state.measurement.pairs.distance[0, 0] = 0.7
    assert state.dynamics.M.any()
    other = copied(state)
    other.move(0.02, Q + 0.02, V)
    assert (state.t, other.commanded.tolist()) == (0.01, V.tolist())
    assert other.measurement.pairs.table[0, 0, 0] == 0.7
    other.measurement.pairs.distance[0, 0] = 0.8
    assert other.measurement.pairs.table[0, 0, 0] == 0.8
    np.testing.assert_array_equal(state.q, Q + 0.01)
    state.move(0.02, Q + 0.02, V)
    for one, own in (*zip(other.kinematics, state.kinematics, strict=True),
                     (other.dynamics.M, state.dynamics.M)):
        np.testing.assert_array_equal(one, own)


@COPIES
def test_a_copy_of_a_stack_that_was_used_is_a_stack_of_its_own(copied):
    s, state = stack(), state_at(Q, V)
    h = s.hierarchy(state)
    other = copied(s)
    np.testing.assert_array_equal(other.hierarchy(state).A, h.A)
    assert not np.shares_memory(other.hierarchy(state).A, h.A)
    other.insert(TASKS["posture"])
    other.remove("position")
    s.insert(TASKS["posture"], 0)
    assert s.hierarchy(state).names == ("posture", "position", "pointing", "avoidance")


def test_a_reference_that_is_set_counts_from_the_next_tick_on():
    s, state, new = stack("velocity", reference=TASKS["posture"]), state_at(Q, V), np.full(7, 0.4)
    for reference, value in ((TASKS["posture"], 0.1 - Q), (tasks.Posture(new), new - Q),
                             (None, np.zeros(7))):
        s.reference = reference
        np.testing.assert_allclose(s.hierarchy(state).reference, value, atol=1e-15)
    refused("reference of a stack", setattr, s, "reference", "posture")


@pytest.mark.parametrize(("edit", "said"), [
    (lambda s: s.remove("pose"), "unknown task 'pose'"),
    (lambda s: s.swap("position", "pointin"), "did you mean 'pointing'"),
    (lambda s: s.insert(TASKS["position"]), "already has a task 'position'; give each its own"),
    (lambda s: s.insert(TASKS["pose"], 9), "index 9"),
    (lambda s: s.reorder(["position"]), "each of"),
    (lambda s: Stack().hierarchy(State.at(ROBOT, Q)), "stack is empty"),
    (lambda s: s.reorder(["position", "position", "pointing"]), "each of"),
    (lambda s: s.hierarchy(state_at(Q, V), ("posture",)), "unknown task 'posture'"),
    (lambda s: Stack([tasks.JointDamping(6)]).hierarchy(state_at(Q, V)), "6 joints, the robot ha")])
def test_bad_edits_are_named(edit, said):
    refused(said, edit, stack())


def test_a_task_whose_sides_cross_is_named_with_its_row(monkeypatch):
    monkeypatch.setattr(tasks.JointLimits, "writer", lambda self, state, level, rows: (
        lambda: (rows.upper.fill(3.0), rows.lower.put(2, 4.0))))
    stack = Stack([TASKS["position"], tasks.JointLimits(ROBOT, 5.0, 0.01)], "velocity")
    assert repr(stack) == "Stack(position > joint limits; velocity level)"
    refused(f"task 'joint limits', {ROBOT.velocity_names[2]}: no value lies between",
            stack.hierarchy, state_at(Q, V))
