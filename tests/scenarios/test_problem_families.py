"""Fresh problems look like the stored ones of their family, and are harder rather than easier."""

import numpy as np
import pytest

from scenarios.problems import recorded
from scenarios.problems import reference as families
from scenarios.problems.families import FAMILIES as FAMILIES_OF_ALL
from scenarios.problems.postures import posed
from solvers import Status, certify, make
from solvers.problems import FAMILIES, family

SEEDS = range(40)


@pytest.mark.parametrize("name", FAMILIES)
def test_sizes_equalities_norms_of_rows_and_ranks_are_those_of_the_stored_problems(name):
    stored, fresh = [p.h for p in families.family(name)], [family(name, s) for s in SEEDS]
    for h in fresh:
        assert h.sizes.tolist() == stored[0].sizes.tolist()
        assert np.array_equal(h.lower == h.upper, stored[0].lower == stored[0].upper)
    expected, found = (np.mean([np.linalg.norm(h.A, axis=1) for h in made], axis=0)
                       for made in (stored, fresh))
    np.testing.assert_allclose(found, expected, atol=0.35 * expected.max())
    assert {ranks(h) for h in fresh} <= {ranks(h) for h in stored}


def test_the_stored_answers_are_certified_and_half_of_its_ticks_meet_no_limit():
    problems = families.family("DYN60")
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


def ranks(h):
    return tuple(int(np.linalg.matrix_rank(A, tol=1e-7)) for A, *_ in h.levels())


@pytest.mark.parametrize(("name", "count"), [("singular-lwr", 24), ("singular-dual-arm", 24),
                                             ("singular-humanoid", 12)])
def test_at_singular_postures_no_limit_is_passed_and_answers_are_solved(name, count):
    """The step to the target of a nearly singular level is 1e13 rad/s long, and cut by a limit.

    Of the humanoid's, 38 of 150 with other seeds are INACCURATE; of the others 2 of 300.
    """
    solved = 0
    for h in posed(name, 26112301, count):
        res = make("hcod").solve(h)
        assert h.violations(res.x)[0] < 1e-12
        solved += res.status is Status.SOLVED
    assert solved >= count - (count // 3 if name == "singular-humanoid" else 2)


@pytest.mark.parametrize("name", ["of-pink", "of-mink", "of-placo", "of-tsid"])
def test_problems_of_other_packages_get_other_targets_with_a_seed_and_keep_rows_and_limits(name):
    public, fresh = (FAMILIES_OF_ALL[name].half(seed, 12).problems for seed in (0, 26112682))
    for h, new in zip(public, fresh, strict=True):
        top = h.sizes[0]
        assert np.array_equal(h.A, new.A)
        assert np.array_equal(h.upper[:top], new.upper[:top])
        assert not np.array_equal(h.lower, new.lower)
        res = make("hcod").solve(new)
        assert res.status is Status.SOLVED
        assert certify(new, res.x).certified
