"""The recorded family DYN60: certified answers, sequences, and a recorder that repeats it."""

import numpy as np

from scenarios.problems import recorded
from scenarios.problems.reference import family
from solvers import certify


def test_its_stored_answers_are_certified_and_half_of_its_ticks_meet_no_limit():
    problems = family("DYN60")
    assert len(problems) == recorded.COUNT
    free = 0
    for problem in problems:
        assert problem.h.n == 60
        assert certify(problem.h, problem.x).certified
        np.testing.assert_allclose(problem.h.violations(problem.x), problem.norms, atol=1e-9)
        limits = problem.h.A[18:88] @ problem.x
        room = np.minimum(limits - problem.h.lower[18:88], problem.h.upper[18:88] - limits)
        free += bool(room.min() > 1e-6)
    assert 30 <= free <= 70
