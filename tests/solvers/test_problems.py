"""Generated problems: the same for a seed, of the sizes asked for, with all that is hard."""


import numpy as np
import pytest
from hypothesis import given, settings
from pinned import problem_sums, read

from hierarchy import Hierarchy, HierarchyError
from solvers import certify, make, problems
from solvers.problems import KINDS, Recipe, structured


@pytest.mark.parametrize(("knob", "value"), [
    ("joints", (0, 5)), ("joints", (5, 2)), ("rows", (-1, 3)), ("spread", 0.5), ("ties", 1.5),
    ("scales", (1.0, np.inf)), ("empty", float("nan"))])
def test_a_knob_out_of_range_is_named(knob, value):
    with pytest.raises(HierarchyError, match=f"recipe: {knob} = "):
        Recipe(**{knob: value})


@settings(max_examples=50, deadline=None, derandomize=True)
@given(problems.strategy(Recipe(joints=(1, 8), levels=(1, 4), rows=(0, 6), equalities_only=True)))
def test_hypothesis_draws_the_same_kind_of_problem(h):
    assert h.n <= 8
    assert certify(h, make("tpm").solve(h).x).certified


def test_a_seed_means_the_problem_that_it_meant_when_it_was_reported():
    expected = read("problems")
    for kind, sums in problem_sums().items():
        allowed = 1e-6 if kind == "bounded" else 1e-10  # a box lies around a solution, as rounded
        assert sums == pytest.approx(expected.pop(kind), rel=0.0, abs=allowed), kind
    assert not expected


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_a_valid_hierarchy_also_of_equalities_alone(kind):
    for seed in range(10):
        h = structured(seed, (kind,))
        Hierarchy.from_levels(list(h.levels()), h.reference)
        assert structured(seed, (kind,), equalities_only=True).is_equality
    with pytest.raises(HierarchyError, match="'arms'"):
        structured(0, ("arms",))
