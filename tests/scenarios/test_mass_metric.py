"""`control.metric = "mass"`: the same tasks, served with the least inertia."""

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError
from scenarios import load
from scenarios.cell.build import build
from scenarios.loop.controller import Controller
from solvers import certify, make

pytestmark = pytest.mark.slow


def hierarchies(changes=(), ticks=10):
    """The hierarchies of the first ticks of `ellipse-mass`, with what was sent."""
    scenario = load("ellipse-mass", list(changes))
    cell = build(scenario)
    controller, period = Controller(scenario, cell), scenario.control.period
    for tick in range(ticks):
        x = controller.command(tick * period, cell.plant.q, cell.plant.v)
        yield controller.hierarchy, x, cell.state.mass_matrix()
        cell.plant.act(x)


def test_every_command_is_certified_in_the_inertia_of_its_tick():
    for h, x, M in hierarchies():
        np.testing.assert_array_equal(h.metric, M)
        assert certify(h, x).certified


def test_no_other_command_that_serves_the_tasks_has_less_inertia():
    for h, x, M in hierarchies(ticks=5):
        plain = Hierarchy(h.A, h.lower, h.upper, h.sizes, h.reference, h.names)
        other = make("hcod").solve(plain).x
        np.testing.assert_allclose(h.violations(other), h.violations(x), atol=1e-9)
        mine, theirs = x - h.reference, other - h.reference
        assert mine @ M @ mine < theirs @ M @ theirs
        assert mine @ mine > theirs @ theirs


def test_other_resolvers_find_the_same_command_or_refuse_the_bounds():
    h, x, _ = next(hierarchies(ticks=1))
    for name in ("hqp", "weighted"):
        assert np.abs(make(name).solve(h).x - x).max() < 1e-2 * (1.0 + np.abs(x).max())
    assert np.abs(make("hqp").solve(h).x - x).max() < 1e-6 * (1.0 + np.abs(x).max())
    with pytest.raises(HierarchyError, match="a row over several"):
        make("sns").solve(h)


def test_bounds_in_the_inertia_are_for_resolvers_of_any_rows():
    assert load("ellipse-limits").asks == "bounds"
    assert load("ellipse-limits", ["control.metric=mass"]).asks == "inequalities"
    assert load("ellipse", ["control.metric=mass"]).asks == "equalities"
