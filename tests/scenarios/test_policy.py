"""What is sent in a tick with trouble."""

import numpy as np
import pytest

from hierarchy import HierarchyError, Robot, State
from hierarchy.tasks import JointLimits
from scenarios.config import load
from scenarios.config.control import PolicySection
from scenarios.loop.controller import Controller
from scenarios.loop.policy import Policy
from solvers import Resolution, Status

PERIOD = 0.001
V = np.array([0.5, -1.0, 0.0])
X = np.array([3.0, 1.0, -2.0])
STATUSES = [status for status in Status if status is not Status.SOLVED]
KINDS = [*(status.name.lower() for status in STATUSES), "not_finite", "stale", "overrun", "inside"]


def policy(level="acceleration", clamp=None, period=PERIOD, **section):
    return Policy(PolicySection(**section), level, period, clamp)


def bound(x):
    return np.clip(x, -1.5, 1.5)


def test_every_status_but_solved_has_a_policy():
    for status in STATUSES:
        assert getattr(PolicySection(), status.name.lower()) == "brake"


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_trouble_brakes_unless_told_otherwise(kind):
    p = policy()
    np.testing.assert_array_equal(p.choose(0.0, [kind], X, V), -10.0 * V)
    assert list(p.events) == [(kind, "brake")]


def test_a_tick_without_trouble_sends_the_answer_and_has_no_event():
    p = policy()
    assert p.choose(0.0, [], X, V) is X
    assert list(p.events) == []


def test_braking_at_velocity_level_is_standing_still():
    np.testing.assert_array_equal(policy("velocity").choose(0.0, ["stale"], X, V), np.zeros(3))


@pytest.mark.parametrize("period", [0.001, 0.1, 0.5, 1.0])
def test_braking_ends_at_rest_and_never_swings_through_it(period):
    p, v = policy(period=period), V.copy()
    for _ in range(round(5.0 / period)):
        after = v + p.choose(0.0, ["stale"], X, v) * period
        assert (after * v >= 0.0).all()
        v = after
    assert np.abs(v).max() < 1e-9


def test_the_last_command_is_held_for_as_long_as_patience_lasts():
    p = policy(stale="hold", patience=3)
    p.choose(0.0, [], X, V)
    for _ in range(3):
        np.testing.assert_array_equal(p.choose(0.0, ["stale"], 9 * X, V), X)
        assert list(p.events) == [("stale", "hold")]
    np.testing.assert_array_equal(p.choose(0.0, ["stale"], 9 * X, V), -10.0 * V)
    assert list(p.events) == [("stale", "brake")]


def test_a_good_tick_restores_patience():
    p = policy(stale="hold", patience=1)
    for _ in range(3):
        p.choose(0.0, [], X, V)
        np.testing.assert_array_equal(p.choose(0.0, ["stale"], 9 * X, V), X)


def test_where_there_is_nothing_to_hold_it_brakes():
    p = policy(stale="hold")
    np.testing.assert_array_equal(p.choose(0.0, ["stale"], X, V), -10.0 * V)
    assert list(p.events) == [("stale", "brake")]


def test_an_answer_in_doubt_may_be_used():
    p = policy(inaccurate="use")
    np.testing.assert_array_equal(p.choose(0.0, ["inaccurate"], X, V), X)
    assert list(p.events) == [("inaccurate", "use")]


@pytest.mark.parametrize(("asked", "done"), [
    ({"inaccurate": "use", "overrun": "hold"}, "hold"),
    ({"inaccurate": "brake", "overrun": "hold"}, "brake"),
    ({"inaccurate": "use", "overrun": "brake"}, "brake"),
    ({"inaccurate": "stop", "overrun": "brake"}, "stop"),
])
def test_of_two_troubles_the_graver_measure_is_taken(asked, done):
    p = policy(**asked)
    p.choose(0.0, [], X, V)
    p.choose(0.0, ["inaccurate", "overrun"], X, V)
    assert list(p.events) == [("inaccurate", done), ("overrun", done)]


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_a_stop_is_at_rest_after_one_tick_and_says_why_the_run_ends(level):
    p = policy(level, not_finite="stop")
    x = p.choose(0.25, ["not_finite"], X, V)
    after = x if level == "velocity" else V + x * PERIOD
    np.testing.assert_allclose(after, 0.0, atol=1e-12)
    assert p.stopped
    assert p.fault == "stopped by its policy at t = 0.250 s: not_finite"


def test_within_limits_a_stop_takes_its_time_and_nothing_interrupts_it():
    p = policy(clamp=bound, stale="stop")
    v, ticks = V.copy(), 0
    while not p.stopped:
        x = p.choose(0.1, ["stale"] if ticks == 0 else [], X, v)
        assert np.abs(x).max() <= 1.5
        v, ticks = v + x * PERIOD, ticks + 1
        assert ticks <= 1000
    assert ticks == pytest.approx(1.0 / 1.5 / PERIOD, abs=2)
    np.testing.assert_allclose(v, 0.0, atol=1e-9)


def test_a_command_beyond_the_limits_is_clamped_and_that_is_an_event():
    p = policy(clamp=bound)
    np.testing.assert_array_equal(p.choose(0.0, [], X, V), bound(X))
    assert list(p.events) == [("beyond_limits", "clamp")]
    np.testing.assert_array_equal(p.choose(0.0, [], X / 3, V), X / 3)
    assert list(p.events) == []


def test_braking_within_the_limits_is_no_event_of_its_own():
    p = policy(clamp=bound)
    np.testing.assert_array_equal(p.choose(0.0, ["stale"], X, V), bound(-10.0 * V))
    assert list(p.events) == [("stale", "brake")]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_an_answer_that_is_not_finite_is_never_sent(bad):
    p = policy()
    x = p.choose(0.0, [], np.array([0.0, bad, 0.0]), V)
    np.testing.assert_array_equal(x, -10.0 * V)
    assert list(p.events) == [("numerical_failure", "brake")]
    q = policy(inaccurate="use")
    assert np.isfinite(q.choose(0.0, ["inaccurate"], np.array([0.0, bad, 0.0]), V)).all()


@pytest.mark.parametrize(("change", "said"), [
    ("control.policy.stale=brke", "control.policy.stale: Input should be 'brake', 'hold' or"),
    ("control.policy.stail=brake", "did you mean 'control.policy.stale'"),
    ("control.policy.not_finite=use", "control.policy.not_finite: Input should be"),
    ("control.policy.numerical_failure=use", "control.policy.numerical_failure: Input should be"),
    ("control.policy.patience=-1", "control.policy.patience"),
    ("control.policy.deadline=0", "control.policy.deadline"),
    ("control.policy.stale_after=nan", "control.policy.stale_after"),
])
def test_a_policy_that_does_not_exist_is_named(change, said):
    with pytest.raises(HierarchyError) as error:
        load("ellipse", [change])
    assert said in str(error.value)


class Saying:
    """A resolver that says what it is told of a right answer."""

    def __init__(self, scenario):
        self.resolver, self.status = scenario.make_resolver(), Status.SOLVED

    def solve(self, h, memory=None):
        return Resolution(self.resolver.solve(h).x, self.status)


def controller(*changes, name="ellipse", **parts):
    scenario = load(name, changes)
    made = Controller(scenario, **parts)
    made.resolver = Saying(scenario)
    return made, made.cell.plant.q.copy(), made.cell.plant.v.copy()


@pytest.mark.parametrize("status", STATUSES)
def test_the_policy_of_a_status_is_followed(status):
    kind = status.name.lower()
    c, q, v = controller(f"control.policy.{kind}=hold")
    good = c.command(0.0, q, v)
    c.resolver.status = status
    np.testing.assert_array_equal(c.command(0.001, q + 0.1, v), good)
    assert list(c.policy.events) == [(kind, "hold")]


@pytest.mark.parametrize("what", ["q", "v", "both"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_measured_may_be_nan_at_the_first_tick_already(what, bad):
    c, q, v = controller()
    broken_q, broken_v = q.copy(), v.copy()
    (broken_q if what == "q" else broken_v)[2] = bad
    if what == "both":
        broken_q[:] = bad
    x = c.command(0.0, broken_q, broken_v)
    assert list(c.policy.events) == [("not_finite", "brake")]
    np.testing.assert_array_equal(x, np.zeros(7))
    np.testing.assert_array_equal(c.cell.state.q, q)
    assert not c.answered


@pytest.mark.parametrize("name", ["ellipse", "ellipse-velocity"])
def test_without_a_measurement_the_last_state_is_carried_on_by_the_commands_sent(name):
    """Otherwise a robot that brakes blind would brake from a speed it has no more."""
    c, _, _ = controller(name=name)
    plant, nothing = c.cell.plant, np.full(7, np.nan)
    for k in range(400):
        blind = k >= 100
        if blind:
            known = plant.q.copy(), plant.v.copy()
        x = c.command(k * PERIOD, nothing if blind else plant.q, plant.v)
        if blind:
            np.testing.assert_allclose(c.cell.state.q, known[0], rtol=0, atol=1e-12)
            np.testing.assert_allclose(c.cell.state.v, known[1], rtol=0, atol=1e-12)
        plant.act(x)
        if k == 99:
            speed = np.abs(plant.v).max()
    assert speed > 0.01
    assert np.abs(plant.v).max() < 0.06 * speed


def test_a_measurement_is_stale_only_after_its_time():
    c, q, v = controller("control.policy.stale_after=0.005")
    for k in range(12):
        c.command(k * PERIOD, q, v, min(k, 3) * PERIOD)
        assert list(c.policy.events) == ([("stale", "brake")] if k > 8 else [])
    c.command(0.012, q, v, 0.012)
    assert list(c.policy.events) == []


def test_a_tick_over_its_deadline_is_told_by_the_clock():
    now = [0.0]

    def clock():
        now[0] += 0.1  # so a tick takes 0.3 s from begin to answer
        return now[0]

    for deadline, kinds in ((0.31, []), (0.29, ["overrun"])):
        c, q, v = controller(f"control.policy.deadline={deadline}")
        c.clock = clock
        c.command(0.0, q, v)
        assert [kind for kind, _ in c.policy.events] == kinds


def test_a_point_inside_an_obstacle_is_trouble_and_may_be_left_by_the_answer():
    inside = "avoidance.obstacles=[{shape='sphere', centre=[0.9, 0.9, 0.9], radius=0.05}]"
    for action in ("brake", "use"):
        c, q, v = controller(inside, f"control.policy.inside={action}")
        c.command(0.0, q, v)
        assert list(c.policy.events) == []
        c.cell.sensor.obstacles.centres[0] = c.cell.sensor.measurement.points[2]
        x = c.command(0.001, q, v)
        assert list(c.policy.events) == [("inside", action)]
        assert c.answered
        assert (x is c.resolution.x) == (action == "use")


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_whatever_is_asked_commands_stay_within_the_joint_limits(level):
    robot = Robot.named("kuka_lwr")
    limits = JointLimits(robot, 5.0, PERIOD)
    rng = np.random.default_rng(3)
    q = rng.uniform(0.8 * robot.lower, 0.8 * robot.upper)
    state, v = State.at(robot, q), np.zeros(7)
    p = Policy(PolicySection(stale="hold", inaccurate="use", patience=50), level, PERIOD,
               lambda x: limits.clamp(state, level, x))
    for k in range(2000):
        state.move(k * PERIOD, q, v)
        low, up = limits.box(state, level)
        troubles = ([], ["stale"], ["inaccurate"], ["overrun"])[rng.integers(4)]
        x = p.choose(k * PERIOD, troubles, 50.0 * rng.normal(size=7), v)
        assert (low <= x).all()
        assert (x <= up).all()
        q = q + (x * PERIOD if level == "velocity" else v * PERIOD + x * PERIOD**2 / 2)
        v = x if level == "velocity" else v + x * PERIOD
    assert (robot.lower <= q).all()
    assert (q <= robot.upper).all()
