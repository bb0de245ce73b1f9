"""The recorded family DYN60: certified answers, sequences, and a recorder that repeats it."""

import numpy as np

from scenarios.problems import recorded
from scenarios.problems.reference import family
from solvers import certify, make


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


def test_problems_of_a_sequence_know_the_tick_before_from_which_a_warm_start_goes_on():
    problems = family("DYN60")
    firsts = [p for p, problem in enumerate(problems) if problem.before is None]
    assert firsts == list(range(0, recorded.COUNT, recorded.TOGETHER))
    second = problems[1]
    assert second.before is problems[0].h
    resolver = make("hcod")
    after = resolver.solve(second.h, resolver.solve(second.before).memory)
    np.testing.assert_allclose(after.x, second.x, atol=1e-6)
