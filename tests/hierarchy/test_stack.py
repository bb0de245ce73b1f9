from dataclasses import dataclass

import numpy as np
import pytest
from scene import FRAME, ROBOT, TASKS, state_at, states

from hierarchy import HierarchyError, Stack, State
from hierarchy.tasks import JointDamping, JointLimits, LookAt

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
    assert s.names == ("pointing", "position", "avoidance")
    assert len(s) == 3


def test_rows_are_those_of_the_tasks_named_in_order_and_written_into_the_same_buffers():
    s = Stack([TASKS["position"], LookAt(FRAME, (0.3, 0.3, 0.6))])
    assert s.row_names() == ("x", "y", "z", "x", "y")
    assert s.row_names(("look-at",)) == ("x", "y")
    state = state_at(Q, V)
    h = stack().hierarchy(state, ("avoidance", "position"))
    assert (h.names, h.sizes.tolist()) == (("avoidance", "position"), [3, 3])
    np.testing.assert_array_equal(h.A[:3], TASKS["avoidance 3-D"].jacobian(state))
    np.testing.assert_array_equal(h.A[3:], TASKS["position"].jacobian(state))
    assert h.is_equality
    s, state = stack(), state_at(Q, V)
    first = s.hierarchy(state)
    A = first.A.copy()
    state.move(0.0, Q + 0.1, V)
    assert s.hierarchy(state) is first
    assert not np.array_equal(first.A, A)


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("task", [JointDamping(7, 5.0), JointDamping(7, 2.0, "mass"),
                                  TASKS["posture"]], ids=["identity", "mass", "posture"])
def test_a_joint_task_is_the_same_as_a_level_and_as_the_reference(task, level):
    state = state_at(Q, V)
    h = Stack([task], level, reference=task).hierarchy(state)
    expected = (task.reference_velocity(state) if level == "velocity"
                else task.reference_acceleration(state))
    np.testing.assert_allclose(h.reference, expected, rtol=1e-14)
    np.testing.assert_array_equal(h.lower, h.reference)
    np.testing.assert_array_equal(h.upper, h.reference)
    np.testing.assert_array_equal(h.A, np.eye(7))
    assert not Stack([task], level).hierarchy(state).reference.any()


@pytest.mark.parametrize(("edit", "said"), [
    (lambda s: s.remove("pose"), "unknown task 'pose'"),
    (lambda s: s.swap("position", "pointin"), "did you mean 'pointing'"),
    (lambda s: s.insert(TASKS["position"]), "already has a task 'position'"),
    (lambda s: s.insert(TASKS["pose"], 9), "index 9"),
    (lambda s: s.reorder(["position"]), "each of"),
    (lambda s: s.reorder(["position", "position", "pointing"]), "each of"),
    (lambda s: s.hierarchy(state_at(Q, V), ("posture",)), "unknown task 'posture'"),
    (lambda s: Stack(level="effort"), "level must be"),
    (lambda s: Stack([JointDamping(6)]).hierarchy(state_at(Q, V)), "6 joints, the robot has 7")])
def test_bad_edits_are_named(edit, said):
    with pytest.raises(HierarchyError) as error:
        edit(stack())
    assert said in str(error.value)


def test_an_empty_stack_is_an_error_and_an_empty_order_is_not():
    with pytest.raises(HierarchyError, match="stack is empty"):
        Stack().hierarchy(State.at(ROBOT, Q))
    assert stack().hierarchy(state_at(Q, V), ()).m == 0


@dataclass(frozen=True)
class Crossed(JointLimits):
    """Limits whose kernel writes sides that cross in the third row."""

    def writer(self, state, level, A, lower, upper, row):
        write = super().writer(state, level, A, lower, upper, row)

        def crossed():
            write()
            lower[row + 2], upper[row + 2] = 3.0, 2.0

        return crossed


def test_a_task_whose_sides_cross_is_named_with_its_row():
    stack = Stack([TASKS["position"], Crossed(ROBOT, 5.0, 0.01)], "velocity")
    third = ROBOT.velocity_names[2]
    with pytest.raises(HierarchyError, match=f"task 'joint limits', {third}: no value lies betw"):
        stack.hierarchy(state_at(Q, V))
