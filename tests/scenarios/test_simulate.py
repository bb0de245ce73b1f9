import signal

import numpy as np
import pytest

import scenarios.loop.simulation
from hierarchy import HierarchyError
from scenarios.config import ScenarioError, load
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate
from solvers import Resolution, Status

pytestmark = pytest.mark.slow

SHORT = ["control.duration=3.0"]


@pytest.fixture(scope="module")
def run():
    return simulate(load("ellipse"))


@pytest.fixture(scope="module")
def velocity_run():
    return simulate(load("ellipse-velocity"))


def test_row_0_is_the_start_and_time_runs_by_the_period(run):
    np.testing.assert_array_equal(run["q"][0], load("ellipse").start.q)
    assert not run["v"][0].any()
    assert run.ticks == 18850
    np.testing.assert_allclose(np.diff(run["t"]), 1e-3)


def test_the_command_of_a_row_leads_to_the_state_of_the_next(run):
    T, q, v, a = 1e-3, run["q"], run["v"], run["a"]
    np.testing.assert_allclose(v[1:], v[:-1] + a[:-1] * T, atol=1e-15)
    np.testing.assert_allclose(q[1:], q[:-1] + v[:-1] * T + a[:-1] * T * T / 2, atol=1e-14)
    np.testing.assert_array_equal(run["a"], run["command"])


def test_the_velocity_command_is_the_next_velocity(velocity_run):
    r = velocity_run
    np.testing.assert_array_equal(r["v"][1:], r["command"][:-1])
    np.testing.assert_allclose(r["a"][:-1], np.diff(r["v"], axis=0) / 1e-3, atol=1e-9)


def test_every_answer_is_certified_where_asked_and_nothing_is_where_not(run):
    judged = simulate(load("ellipse", ["control.options.damping=0.0", "control.duration=0.4"]),
                      certified=True)
    assert judged["certified"].shape == (400,)
    assert judged["certified"].all()
    assert "certified" not in run


def test_velocity_steps_are_bounded_at_acceleration_level_and_large_at_velocity_level(
        run, velocity_run):
    step, largest = np.abs(np.diff(run["v"], axis=0)).max(), np.abs(run["a"]).max()
    assert step <= largest * 1e-3 * (1 + 1e-9)
    assert np.abs(np.diff(velocity_run["v"], axis=0)).max() > 10 * step


def test_the_cone_is_in_the_stack_exactly_while_it_is_violated(run):
    np.testing.assert_array_equal(run["pointing_active"], run["pointing_error"] > 0)
    assert 0 < run["pointing_active"].mean() < 1
    in_order = np.array(["pointing" in order for order in run.orders])[run["order"]]
    np.testing.assert_array_equal(run["pointing_active"], in_order)


def test_the_active_point_is_recorded_exactly_while_avoidance_is_in_the_stack(run):
    near = run["minimal_distance"] <= 0.15
    np.testing.assert_array_equal(run["active_control_point"] > 0, near)
    k = np.flatnonzero(near)
    picked = run["control_point_distance"][k, run["active_control_point"][k] - 1]
    np.testing.assert_array_equal(picked, run["minimal_distance"][k])


def test_repulsion_is_recorded_within_its_area(run):
    np.testing.assert_array_equal(run["repulsion_active"], run["ee_distance"] <= 0.1)
    assert run["repulsion_active"].any()


def test_the_path_is_followed_where_nothing_is_near(run):
    free = (run["ee_distance"] > 0.15) & (run["t"] > 3)
    assert np.median(np.linalg.norm(run["position_error"][free], axis=1)) < 1e-3
    assert (run["status"] == Status.SOLVED).all()


def test_the_same_scenario_gives_the_same_run(run):
    again = simulate(load("ellipse"))
    for name in ("q", "v", "a", "order"):
        np.testing.assert_array_equal(again[name], run[name])


def test_a_scenario_may_have_any_of_its_tasks():
    base = load("ellipse", SHORT)
    only = base.model_copy(update={"avoidance": None, "pointing": None})
    run = simulate(only)
    assert run.orders == ("position",)
    assert "ee_distance" not in run
    assert np.abs(run["position_error"][2500:]).max() < 1e-4
    cone = simulate(base.model_copy(update={"avoidance": None, "position": None}))
    assert set(cone.orders) <= {"pointing", ""}
    assert "position_error" not in cone
    assert cone["pointing_error"][-1] < 0.01


def test_posture_may_be_the_null_space_term():
    scenario = load("ellipse", SHORT).model_copy(update={"damping": None})
    q = list(scenario.start.q)
    posture = load("ellipse", [*SHORT]).model_dump()
    posture["damping"], posture["posture"] = None, {"target": q}
    run = simulate(type(scenario).model_validate(posture))
    assert run.fault is None


def test_a_start_is_found_for_an_end_effector_position():
    scenario = load("ellipse", [*SHORT, "start.end_effector=[0.2, 0.6, 0.2]"])
    run = simulate(scenario)
    np.testing.assert_allclose(run["ee_position"][0], [0.2, 0.6, 0.2], atol=1e-5)


@pytest.mark.parametrize(("changes", "said"), [
    (["start.end_effector=[2, 0, 0]"], "start.end_effector [2.0, 0.0, 0.0] m cannot be reached"),
    (["start.q=[0, 0, 0]"], "start: 3 values for 7 joint positions of robot 'kuka_lwr'"),
    (["start.v=[0, 0]"], "start: robot 'kuka_lwr': v has shape (2,)"),
    (["avoidance.obstacles=[[5, 5, 5], [0.0, 0.0, 0.0]]", "start.q=[0, 0, 0, 0, 0, 0, 0]",
      "robot.control_points=[{joint='joint_2', offset=[0, 0, 0]}]"],
     "obstacle 2 at [0.0, 0.0, 0.0] m touches control point 1"),
    (["robot.model=kuka_lvr"], "did you mean 'kuka_lwr'"),
    (["robot.end_effector=tool"], "unknown frame 'tool'"),
    (["robot.control_points=[]"], "has no control points"),
    (["robot.control_points=[{joint='elbow', offset=[0, 0, 0]}]"], "unknown joint 'elbow'"),
    (["avoidance.jacobian=published"], "has no exact derivative"),
])
def test_a_scenario_that_does_not_fit_its_robot_is_named(changes, said):
    with pytest.raises(HierarchyError) as error:
        simulate(load("ellipse", [*SHORT, *changes]))
    assert said in str(error.value)


def test_an_unreachable_start_is_a_scenario_error():
    with pytest.raises(ScenarioError):
        simulate(load("ellipse", ["start.end_effector=[0, 0, -3]"]))


def test_an_interrupted_run_keeps_what_was_run():
    def interrupt(done, total):
        if done == 1000:
            signal.raise_signal(signal.SIGINT)

    run = simulate(load("ellipse", SHORT), progress=interrupt)
    assert run.fault == "interrupted at tick 1000"
    assert run.ticks == len(run["q"]) == len(run["time_tick"]) == 1000


def test_progress_is_told_to_the_end():
    seen = []
    simulate(load("ellipse", ["control.duration=1.2"]), lambda *args: seen.append(args))
    assert seen == [(0, 1200), (500, 1200), (1000, 1200), (1200, 1200)]


class Failing:
    """A resolver without an answer from some tick on."""

    def __init__(self, resolver, after):
        self.resolver, self.left = resolver, after

    def solve(self, h, memory=None):
        self.left -= 1
        if self.left >= 0:
            return self.resolver.solve(h, memory)
        return Resolution(np.zeros(h.n), Status.NUMERICAL_FAILURE)


@pytest.mark.parametrize("name", ["ellipse", "ellipse-velocity"])
def test_a_tick_without_an_answer_brakes(name):
    scenario = load(name)
    controller = Controller(scenario)
    controller.resolver = Failing(scenario.make_resolver(), 0)
    v = np.arange(7.0)
    command = controller.command(0.0, np.array(scenario.start.q), v)
    assert (command @ v < 0) if name == "ellipse" else not command.any()


def test_a_nan_in_the_state_is_a_status_and_not_a_crash():
    controller = Controller(load("ellipse"))
    q = np.array(load("ellipse").start.q)
    q[3] = np.nan
    controller.command(0.0, q, np.zeros(7))
    assert controller.resolution.status is Status.NUMERICAL_FAILURE
    assert np.isfinite(controller.resolution.x).all()


def test_a_run_whose_state_is_lost_ends_with_a_fault(monkeypatch):
    def broken(self, command):
        self.v[2] = np.inf
        self.a[:] = np.inf

    monkeypatch.setattr(scenarios.cell.plants.KinematicArm, "act", broken)
    run = simulate(load("ellipse", SHORT))
    assert run.fault == "the state is not finite from tick 0 on (t = 0.000 s)"
    assert run.ticks == 1


def test_a_run_that_diverges_ends_with_a_fault(monkeypatch):
    def broken(self, command):
        self.v[2] = 1.5e3 if self.v[2] else 1.0

    monkeypatch.setattr(scenarios.cell.plants.KinematicArm, "act", broken)
    run = simulate(load("ellipse", SHORT))
    assert run.fault == ("the motion has diverged: joint joint_3 moves at 1.5e+03 rad/s, more than "
                         "1000, from tick 2 on (t = 0.002 s)")
    assert run.ticks == 3
