import numpy as np
import pytest
from scene import ROBOT, TASKS, state_at, states

from hierarchy import HierarchyError, Stack
from hierarchy.tasks import JointDamping

Q, V = states(1)[0]


def stack(level="acceleration", **kwargs):
    return Stack([TASKS["position"], TASKS["pointing"], TASKS["avoidance 3-D"]], level, **kwargs)


def test_tasks_come_in_the_order_given():
    assert stack().names == ("position", "pointing", "avoidance")


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


def test_rows_of_the_hierarchy_are_those_of_the_tasks_in_order():
    state = state_at(Q, V)
    h = stack().hierarchy(state, ("avoidance", "position"))
    assert h.names == ("avoidance", "position")
    assert h.sizes.tolist() == [3, 3]
    np.testing.assert_array_equal(h.A[:3], TASKS["avoidance 3-D"].jacobian(state))
    np.testing.assert_array_equal(h.A[3:], TASKS["position"].jacobian(state))
    assert h.is_equality


def test_the_same_order_is_written_into_the_same_buffers():
    s, state = stack(), state_at(Q, V)
    first = s.hierarchy(state)
    A = first.A.copy()
    state.move(0.0, Q + 0.1, V)
    assert s.hierarchy(state) is first
    assert not np.array_equal(first.A, A)


def test_changing_the_stack_changes_the_hierarchy():
    s, state = stack(), state_at(Q, V)
    s.hierarchy(state)
    s.remove("avoidance")
    assert s.hierarchy(state).names == ("position", "pointing")
    s.insert(TASKS["avoidance 1-D"], 0)
    assert s.hierarchy(state).sizes.tolist() == [1, 3, 1]


def test_the_reference_is_the_null_space_term():
    state = state_at(Q, V)
    np.testing.assert_allclose(stack(reference=JointDamping(7, 5.0)).hierarchy(state).reference,
                               -5 * V)
    assert not stack(reference=None).hierarchy(state).reference.any()
    velocity = stack("velocity", reference=TASKS["posture"]).hierarchy(state)
    np.testing.assert_allclose(velocity.reference, TASKS["posture"].reference_velocity(state))


@pytest.mark.parametrize(("edit", "said"), [
    (lambda s: s.remove("pose"), "unknown task 'pose'"),
    (lambda s: s.swap("position", "pointin"), "did you mean 'pointing'"),
    (lambda s: s.insert(TASKS["position"]), "already has a task 'position'"),
    (lambda s: s.insert(TASKS["pose"], 9), "index 9"),
    (lambda s: s.reorder(["position"]), "each of"),
    (lambda s: s.reorder(["position", "position", "pointing"]), "each of"),
    (lambda s: s.hierarchy(state_at(Q, V), ("posture",)), "unknown task 'posture'"),
    (lambda s: Stack(level="torque"), "level"),
])
def test_bad_edits_are_named(edit, said):
    with pytest.raises(HierarchyError) as error:
        edit(stack())
    assert said in str(error.value)


def test_an_empty_stack_is_an_error_and_an_empty_order_is_not():
    with pytest.raises(HierarchyError, match="stack is empty"):
        Stack().hierarchy(ROBOT.state(Q))
    assert stack().hierarchy(state_at(Q, V), ()).m == 0
