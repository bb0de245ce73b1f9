"""Stacks: limits, distances, cones and listed tasks in one order; set-based tasks; smooth ones."""

import numpy as np
import pytest
from refusals import refused
from scene import FRAME, ROBOT, state_at, states

from hierarchy import HierarchyError
from hierarchy.task import Rows
from hierarchy.tasks import Pointing
from hierarchy.tasks.together import TangentCone
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.loop.controller import Controller
from scenarios.measure.metrics import measure
from solvers import make


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize("resolver", ["hcod", "weighted"])
def test_limits_and_distances_are_kept_and_no_tick_fails(level, resolver):
    changes = ["control.duration=1.5", f"control.level={level}"]
    scenario = load("ellipse-hqp", changes).with_resolver(resolver)
    certified = resolver == "hcod"  # at velocity level of levels that were calmed
    run = simulate(scenario, certified=certified)
    assert run.fault is None
    assert (run["status"] == 0).all()
    assert np.maximum(run["q"] - run["joint_upper"], run["joint_lower"] - run["q"]).max() <= 1e-9
    assert (np.abs(run["v"]) - run["velocity_limit"]).max() <= 1e-9
    assert np.abs(run["a"]).max() <= 10.0 * (1.0 + 1e-6)
    assert run["minimal_distance"].min() >= scenario.avoidance.distance - 1e-4
    assert not certified or run["certified"].all()


BEYOND = [1.1657, -0.9476, 0.5844, float(ROBOT.upper[3]) + 0.1, 1.1464, 1.7695, 0.0]
STARTS = {"stretched": "start.q=[0, 0, 0, 0, 0, 0, 0]",
          "beyond a limit": f"start={{q={BEYOND}, allow_outside_limits=true}}",
          "too fast": "start.v=[3, -3, 3, -3, 4, -3, 3]"}


@pytest.mark.parametrize("how", STARTS)
@pytest.mark.parametrize(("name", "resolver"), [
    ("human", "recursive"), ("human", "sns"), ("human-hqp", "hcod")])
def test_any_start_is_recovered_from_within_the_limit_of_acceleration(name, resolver, how):
    """A joint beyond its limit comes back without going farther out; too fast, it slows down."""
    run = simulate(load(name, ["control.duration=1.0", "plant={kind='kinematic'}", STARTS[how],
                               "sensor={kind='exact'}"]).with_resolver(resolver))
    assert run.fault is None
    assert np.abs(run["command"]).max() <= run.scenario.limits.acceleration * (1.0 + 1e-9)
    out = np.maximum(run["q"] - ROBOT.upper, ROBOT.lower - run["q"])
    assert (np.diff(np.maximum(out, 0.0), axis=0) <= 1e-12).all()
    assert out[60:].max() <= 1e-12
    excess = np.maximum(np.abs(run["v"]) / ROBOT.velocity_limit - 1.0, 0.0)
    assert (np.diff(excess, axis=0) < 1e-9).all()
    assert excess[-1].max() == 0.0


def test_all_levels_above_the_posture_are_met_and_their_errors_recorded():
    standing = simulate(load("humanoid"))
    assert standing.fault is None
    found = measure(standing)
    for name in ("left_foot", "right_foot", "centre_of_mass"):
        assert found[f"task_{name}_rms"].value < 1e-5
    for name in ("right_hand", "left_hand"):
        assert found[f"task_{name}_max_settled"].value < 1e-4, "what a period of 5 ms leaves"
        assert found[f"task_{name}_end"].value < 1e-5
    assert found["task_gaze_max_settled"].value < 0.05
    assert found["task_left_foot_turned_rms"].unit == "deg"
    assert found["joint_limit_excess"].value == 0.0
    cell, k = build(standing.scenario), 700
    cell.state.move(standing["t"][k], standing["q"][k], standing["v"][k])
    for task in cell.tasks.listed:
        np.testing.assert_allclose(standing[f"task_error_{task.name.replace(' ', '_')}"][k],
                                   task.error(cell.state), atol=1e-15)


# -- set-based tasks and smooth activation in place of Algorithm 1 --------------------------------
def distances(cell):
    """The distance of every point to every obstacle, point by point, by plain arithmetic."""
    seen, centres = cell.sensor.measurement, np.array([o.centre for o in
                                                       cell.scenario.avoidance.obstacles])
    return np.linalg.norm(seen.points[:, None] - centres[None], axis=2).ravel()


def near_obstacles(name, *changes):
    """A controller that has commanded at random joint positions with a point nearer than 0.1 m."""
    for q, _ in states(60, seed=5):
        controller = Controller(build(load(name, changes)))
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
