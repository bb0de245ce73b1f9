"""`Resolution.verified` and `th_verify` repeat the solver's own check on an answer."""

import ctypes

import c_library as c
import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError
from solvers import Status, make, problems

BOX = Hierarchy.from_levels([(np.eye(3), np.full(3, -1.0), np.ones(3)),
                             (np.array([[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]]), np.array([5.0, 0.5]))])
MIXED = [problems.structured(seed) for seed in range(700, 740)]


def moved(res, by):
    return type(res)(res.x + by, res.status, res.memory)


def test_an_answer_called_solved_is_verified_again_from_its_active_rows():
    for h in MIXED:
        res = make("hcod").solve(h)
        assert res.verified(h) == (res.status is Status.SOLVED)


def test_another_x_another_active_set_and_another_problem_are_refused():
    res = make("hcod").solve(BOX)
    assert res.verified(BOX)
    assert not moved(res, 1e-6).verified(BOX)
    assert not res.verified(BOX.changed(upper=BOX.upper + 0.1 * (BOX.upper > BOX.lower)))
    none = res.memory.copy()
    none[:BOX.m] = 0.0
    assert not type(res)(res.x, res.status, none).verified(BOX)


def test_what_reports_no_active_rows_or_has_a_metric_says_who_judges_it():
    with pytest.raises(HierarchyError, match=r"certify\(h, x\)"):
        make("weighted").solve(BOX).verified(BOX.changed(metric=np.eye(3)))


@pytest.mark.slow
def test_c_verifies_what_python_verifies_and_writes_to_its_work_space_only(library):
    verify = ctypes.CFUNCTYPE(ctypes.c_int, *[ctypes.c_void_p] * 5, ctypes.c_int64)(
        library.address("th_verify"))
    resolver = make("hcod")
    for h in MIXED:
        res, (status, memory) = resolver.solve(h), library.solve("hcod", h)
        problem, values = c.problem_of(h), memory.values.copy()
        for by in (0.0, 1e-3):
            memory.x[:-1] = res.x + by
            code = verify(ctypes.addressof(problem), None, ctypes.addressof(memory.record),
                          memory.x.ctypes.data, memory.work.ctypes.data, len(memory.work) - 1)
            assert code == (c.SOLVED if moved(res, by).verified(h) else Status.INACCURATE.value)
            np.testing.assert_array_equal(memory.x[:-1], res.x + by)
        np.testing.assert_array_equal(memory.values, values)
        assert memory.untouched
        assert status == res.status.value
