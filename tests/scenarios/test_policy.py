"""What is sent in a tick with trouble."""

import numpy as np
import pytest

from scenarios.config import load
from scenarios.config.control import PolicySection
from scenarios.loop.controller import Controller
from scenarios.loop.policy import Policy
from solvers import Resolution, Status

PERIOD = 0.001
V = np.array([0.5, -1.0, 0.0])
X = np.array([3.0, 1.0, -2.0])
BRAKE, BAD = -10.0 * V, np.array([0.0, np.nan, 0.0])
STATUSES = [status for status in Status if status is not Status.SOLVED]
KINDS = [*(status.name.lower() for status in STATUSES), "not_finite", "stale", "overrun", "inside"]


def policy(level="acceleration", clamp=None, period=PERIOD, **section):
    return Policy(PolicySection(**section), level, period, clamp)


def bound(x):
    return np.clip(x, -1.5, 1.5)


# Settings; then tick by tick the troubles, the answer, what is sent, and what is said to be done.
TWO = ["inaccurate", "overrun"]
CASES = {
    "no trouble": ({}, [([], X, X, [])]),
    **{f"{kind} brakes": ({}, [([kind], X, BRAKE, ["brake"])]) for kind in KINDS},
    "at velocity level it stands still": (
        {"level": "velocity"}, [(["stale"], X, 0 * X, ["brake"])]),
    "held for as long as patience lasts": (
        {"stale": "hold", "patience": 2}, [([], X, X, []), *[(["stale"], 9 * X, X, ["hold"])] * 2,
                                           (["stale"], 9 * X, BRAKE, ["brake"])]),
    "a good tick restores patience": (
        {"stale": "hold", "patience": 1}, [([], X, X, []), (["stale"], 9 * X, X, ["hold"])] * 3),
    "nothing to hold": ({"stale": "hold"}, [(["stale"], X, BRAKE, ["brake"])]),
    "an answer in doubt may be used": ({"inaccurate": "use"}, [(["inaccurate"], X, X, ["use"])]),
    "the graver of two: brake": ({"inaccurate": "brake", "overrun": "hold"},
                                 [([], X, X, []), (TWO, X, BRAKE, ["brake"] * 2)]),
    "the graver of two: stop": ({"inaccurate": "stop", "overrun": "brake"},
                                [(TWO, X, -V / PERIOD, ["stop"] * 2)]),
    "clamped to the limits": ({"clamp": bound}, [([], X, bound(X), ["clamp"]),
                                                 ([], X / 3, X / 3, [])]),
    "braking within the limits is no event of its own": (
        {"clamp": bound}, [(["stale"], X, bound(BRAKE), ["brake"])]),
    "never NaN": ({}, [([], BAD, BRAKE, ["brake"])]),
    "nor infinite": ({}, [([], np.array([0.0, np.inf, 0.0]), BRAKE, ["brake"])]),
}


@pytest.mark.parametrize("case", CASES)
def test_what_is_sent_and_said(case):
    section, ticks = CASES[case]
    p = policy(**section)
    for troubles, answer, sent, done in ticks:
        np.testing.assert_array_equal(p.choose(0.0, troubles, answer, V), sent)
        assert [action for _, action in p.events] == done
        assert [kind for kind, _ in p.events][:len(troubles)] == troubles


@pytest.mark.parametrize("period", [0.001, 0.1, 1.0])
def test_braking_ends_at_rest_and_never_swings_through_it(period):
    p, v = policy(period=period), V.copy()
    for _ in range(round(5.0 / period)):
        after = v + p.choose(0.0, ["stale"], X, v) * period
        assert (after * v >= 0.0).all()
        v = after
    assert np.abs(v).max() < 1e-9


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_a_stop_is_at_rest_after_one_tick_and_says_why_the_run_ends(level):
    p = policy(level, not_finite="stop")
    x = p.choose(0.25, ["not_finite"], X, V)
    np.testing.assert_allclose(x if level == "velocity" else V + x * PERIOD, 0.0, atol=1e-12)
    assert p.stopped
    assert "0.250 s: not_finite" in p.fault


class Saying:
    """A resolver that says what it is told of a right answer."""

    def __init__(self, scenario):
        self.resolver, self.status = scenario.make_resolver(), Status.SOLVED

    def solve(self, h, memory=None):
        return Resolution(self.resolver.solve(h).x, self.status)


def controller(*changes, name="ellipse"):
    scenario = load(name, changes)
    made = Controller(scenario)
    made.resolver = Saying(scenario)
    return made, made.cell.plant.q.copy(), made.cell.plant.v.copy()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_measured_may_be_nan_at_the_first_tick_already(bad):
    c, q, v = controller()
    v[2] = bad
    np.testing.assert_array_equal(c.command(0.0, q, v), np.zeros(7))
    assert list(c.policy.events) == [("not_finite", "brake")]
    np.testing.assert_array_equal(c.cell.state.q, q)
    assert not c.answered


@pytest.mark.parametrize("name", ["ellipse", "ellipse-velocity"])
def test_without_a_measurement_the_last_state_is_carried_on_by_the_commands_sent(name):
    """Otherwise a robot that brakes blind would brake from a speed it has no more."""
    c, _, _ = controller(name=name)
    plant, nothing, speed = c.cell.plant, np.full(7, np.nan), 0.0
    for k in range(400):
        known = plant.q.copy(), plant.v.copy()
        x = c.command(k * PERIOD, nothing if k >= 100 else plant.q, plant.v)
        np.testing.assert_allclose(c.cell.state.q, known[0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(c.cell.state.v, known[1], rtol=0, atol=1e-12)
        plant.act(x)
        speed = max(speed, np.abs(plant.v).max())
    assert speed > 0.01
    assert np.abs(plant.v).max() < 0.06 * speed


def test_a_measurement_is_stale_only_after_its_time():
    c, q, v = controller("control.policy.stale_after=0.005")
    for k in range(12):
        c.command(k * PERIOD, q, v, min(k, 3) * PERIOD)
        assert list(c.policy.events) == ([("stale", "brake")] if k > 8 else [])
    c.command(0.012, q, v, 0.012)
    assert list(c.policy.events) == []


@pytest.mark.parametrize(("deadline", "kinds"), [(0.31, []), (0.29, ["overrun"])])
def test_a_tick_over_its_deadline_is_told_by_the_clock(deadline, kinds):
    c, q, v = controller(f"control.policy.deadline={deadline}")
    c.clock = iter(np.arange(0.1, 9.0, 0.1)).__next__  # a tick takes 0.3 s from begin to answer
    c.command(0.0, q, v)
    assert [kind for kind, _ in c.policy.events] == kinds


@pytest.mark.parametrize("action", ["brake", "use"])
def test_a_point_inside_an_obstacle_is_trouble_and_may_be_left_by_the_answer(action):
    inside = "avoidance.obstacles=[{shape='sphere', centre=[0.9, 0.9, 0.9], radius=0.05}]"
    c, q, v = controller(inside, f"control.policy.inside={action}")
    c.command(0.0, q, v)
    assert list(c.policy.events) == []
    c.cell.sensor.obstacles.centres[0] = c.cell.sensor.measurement.points[2]
    x = c.command(0.001, q, v)
    assert list(c.policy.events) == [("inside", action)]
    assert c.answered
    assert (x is c.resolution.x) == (action == "use")
