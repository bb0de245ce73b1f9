"""The letter's task with set-based tasks and with smooth activation in place of Algorithm 1."""

import numpy as np
import pytest
from refusals import refused
from scene import FRAME, ROBOT, state_at, states

from hierarchy import HierarchyError
from hierarchy.task import Rows
from hierarchy.tasks import Pointing
from hierarchy.tasks.together import TangentCone
from scenarios import load
from scenarios.cell.build import build
from scenarios.loop.controller import Controller
from solvers import make


def distances(cell):
    """The distance of every point to every obstacle, point by point, by plain arithmetic."""
    seen, centres = cell.sensor.measurement, np.array([o.centre for o in
                                                       cell.scenario.avoidance.obstacles])
    return np.linalg.norm(seen.points[:, None] - centres[None], axis=2).ravel()


def near_obstacles(name, *changes):
    """A controller that has commanded at random joint positions with a point nearer than 0.1 m."""
    for q, _ in states(60, seed=5):
        controller = Controller(load(name, changes))
        controller.command(0.0, q, np.zeros(7))
        if 0.0 < distances(controller.cell).min() < 0.1:
            yield controller


def test_rows_ask_nothing_inside_a_set_and_no_worse_at_its_bound():
    inside = set()
    for controller in near_obstacles("ellipse-set-based", "avoidance.distance=0.1"):
        h, d = controller.hierarchy, distances(controller.cell)
        np.testing.assert_array_equal(h.lower[:27], np.where(d <= 0.1, 0.0, -np.inf))
        assert h.lower[-1] == (0.0 if controller.cone_error >= 0.0 else -np.inf)
        assert np.isinf(h.upper[[*range(27), -1]]).all()
        inside |= set((d <= 0.1).tolist())
    assert inside == {True, False}  # rows of both kinds were compared


def test_the_tangent_cone_of_the_letters_cone_has_its_jacobian_and_refuses_accelerations():
    cone = TangentCone(Pointing(FRAME, (1.0, 0.2, 0.0), 0.3, "inequality"))
    assert (cone.name, cone.kind, cone.dimension) == ("pointing", "inequality", 1)
    for q, v in states(20):
        state = state_at(q, v)
        cosine = np.array([1.0, 0.2, 0.0]) / np.sqrt(1.04) @ state.rotation(FRAME)[:, 2]
        outside = cosine <= np.cos(0.3)
        np.testing.assert_array_equal(cone.reference_velocity(state), [0.0 if outside else -np.inf])
        np.testing.assert_array_equal(cone.jacobian(state), cone.task.jacobian(state))
    with pytest.raises(HierarchyError, match="velocity level, got level = 'acceleration'"):
        cone.writer(state, "acceleration", Rows.empty(1, ROBOT.n))
    refused("kind = 'equality'", lambda: TangentCone(Pointing(FRAME, (1.0, 0.0, 0.0), 0.3)))


def test_a_frozen_task_has_no_rate_that_could_be_too_fast_for_the_period():
    assert build(load("ellipse-set-based", {"control.period": 0.11})).tasks.position


def test_the_smooth_stack_aims_at_the_end_of_its_buffers_and_weights_by_them():
    for controller in near_obstacles("ellipse-smooth", "avoidance.rate=3.0",
                                     "avoidance.recovery=0.1"):
        cell, h, d = controller.cell, controller.hierarchy, distances(controller.cell)
        missing = 0.1 - d  # distance 0.05 and buffer 0.05
        seen = d <= 0.3
        np.testing.assert_allclose(h.lower[:27][seen], np.minimum(3.0 * missing, 0.1)[seen],
                                   atol=1e-12)
        share = np.clip(missing / 0.05, 0.0, 1.0)
        np.testing.assert_allclose(cell.activation()[:27], 0.5 - 0.5 * np.cos(np.pi * share),
                                   atol=1e-12)
        np.testing.assert_array_equal(cell.activation()[27:30], 1.0)
        bound, end = np.cos(np.radians([5.0, 3.0]))
        to_end = end - (bound - controller.cone_error)
        share = np.clip(to_end / (end - bound), 0.0, 1.0)
        np.testing.assert_allclose(cell.activation()[30], 0.5 - 0.5 * np.cos(np.pi * share),
                                   atol=1e-9)
        assert h.lower[30] == pytest.approx(5.0 * to_end)
        alone = make("smooth").solve_activated(h, cell.activation()).x
        np.testing.assert_array_equal(controller.resolution.x, alone)
