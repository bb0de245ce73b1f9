"""`control.metric = "mass"`: the same tasks, served with the least inertia."""

import numpy as np
import pytest

from scenarios import load
from scenarios.cell.build import build
from scenarios.loop.controller import Controller
from solvers import certify

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


def test_bounds_in_the_inertia_are_for_resolvers_of_any_rows():
    assert load("ellipse-limits").asks == "bounds"
    assert load("ellipse-limits", ["control.metric=mass"]).asks == "inequalities"
    assert load("ellipse", ["control.metric=mass"]).asks == "equalities"
