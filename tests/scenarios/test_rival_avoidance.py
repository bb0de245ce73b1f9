"""The avoidance of the letter's references [5] and [10], as scenarios."""

import numpy as np

from hierarchy.tasks import CumulatedRepulsion, DangerBounds
from scenarios import load
from scenarios.cell.build import build

NEAR = np.array([0.923, -0.854, 0.903, 1.195, 0.971, 1.796, 0.0])  # the start of `ellipse`


def at_the_start(scenario):
    cell = build(scenario)
    cell.state.move(0.3, NEAR, np.linspace(-0.3, 0.3, 7))
    return cell, cell.sensor.measure(cell.state)


def test_in_the_null_space_avoidance_is_never_in_the_stack():
    cell, _ = at_the_start(load("ellipse-nullspace"))
    assert set(cell.order.possible) == {("position",), ("position", "pointing")}
    assert isinstance(cell.stack.reference, CumulatedRepulsion)
    assert len(cell.stack.reference.points) == 8
    assert cell.stack.reference.within == 0.15


def test_what_the_null_space_gets_moves_no_task_of_the_stack():
    """At full rank the rows hold to rounding, while the null-space term differs from damping."""
    wide = {"avoidance.far": 0.6, "control.options": {"form": "staircase"}}
    cell, _ = at_the_start(load("ellipse-nullspace", wide))
    plain, _ = at_the_start(load("ellipse", wide))
    order = ("position", "pointing")
    h, damped = cell.stack.hierarchy(cell.state, order), plain.stack.hierarchy(plain.state, order)
    assert np.abs(h.reference - damped.reference).max() > 0.05
    resolver = load("ellipse-nullspace", wide).make_resolver()
    x, without = resolver.solve(h).x, resolver.solve(damped).x
    np.testing.assert_allclose(h.A @ x, h.lower, atol=1e-9)
    assert np.abs(x - without).max() > 1e-3


def test_danger_closes_the_box_of_joints_and_pushes_nothing():
    scenario = load("ellipse-danger-bounds")
    cell, seen = at_the_start(scenario)
    box = cell.stack["joint limits"]
    assert isinstance(box, DangerBounds)
    assert box.reach == 0.15
    seen.distance[:8] = 0.04
    assert "avoidance" not in cell.order(seen, 1.0).order
    assert scenario.make_resolver().name == "sns"
