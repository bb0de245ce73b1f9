"""The box of joint limits under adversaries, against braking simulated tick by tick."""

import os

import numpy as np
import pinocchio as pin
import pytest
from scene import ROBOT, state_at, states
from standing import written

from hierarchy import State
from hierarchy.jit import compiled
from hierarchy.limits import Limits, write_box
from hierarchy.tasks import JointLimits, TorqueLimits
from hierarchy.tasks.joints.joint_limits import StepLimits

PLAIN = os.environ.get("NUMBA_DISABLE_JIT") == "1"  # everything some hundred times slower
JOINTS, TICKS = (40, 60) if PLAIN else (500, 400)
LEVELS = pytest.mark.parametrize("level", ["velocity", "acceleration"])

# Rounding: of a position relative to 1 + |q|, of a speed and an acceleration relative to the limit.
# An acceleration is (x - v) / T at velocity level: the rounding of v = 10 over T = 1e-4 s is 2e-11.
POSITION, SPEED, ACCELERATION = 1e-12, 1e-12, 1e-9


# ---- a plant that remembers what it has seen --------------------------------------------------
def spread(values, *shape):
    """An array of its own of this shape: kernels are compiled once for all that are alike."""
    return np.array(np.broadcast_to(values, shape), dtype=float, order="C")


class Ride:
    """What happened to joints driven through picks (ticks, joints): 0 is the lower end of the box.

    high, low : extreme positions, also between ticks. q, v (ticks, joints) : after each tick.
    """

    def __init__(self, q, v, limits, period, level, picks, horizon=0.0):
        T, accelerates = spread(period, len(q)), level == "acceleration"
        packed = np.vstack([limits, T, spread(horizon, len(q))])
        box, seen, a = np.empty((2, len(q))), [], [0.0]
        self.high, self.low = q, q
        for pick in picks:
            write_box(q, v, packed, accelerates, *box)
            assert np.isfinite(box).all(), "a box was not finite"
            assert (box[0] <= box[1]).all(), "a box was empty"
            x = box[0] * (1.0 - pick) + box[1] * pick
            a.append(np.abs(x if accelerates else (x - v) / T))
            q, v, turn = moved(q, v, x, T) if accelerates else (q + x * T, x, q)
            self.high = np.maximum(self.high, np.maximum(q, turn))
            self.low = np.minimum(self.low, np.minimum(q, turn))
            seen.append((q, v))
        self.q, self.v = np.array(seen).transpose(1, 0, 2)
        self.speed, self.acceleration = np.abs(self.v).max(axis=0), np.max(a[1:], axis=0)

    def keeps_acceleration(self, limits):
        assert (self.acceleration <= limits[3] * (1 + ACCELERATION)).all()

    def keeps(self, limits):
        lower, upper, velocity, _ = limits
        assert (self.high - upper <= POSITION * (1 + np.abs(self.high))).all()
        assert (lower - self.low <= POSITION * (1 + np.abs(self.low))).all()
        assert (self.speed <= velocity * (1 + SPEED)).all()
        self.keeps_acceleration(limits)


def moved(q, v, a, T):
    """Return q and v after a tick, and where a joint turns between ticks, or q."""
    after = v + a * T
    turns = v * after < 0.0
    return (q + v * T + a * T * T / 2, after,
            np.where(turns, q - v * v / np.where(turns, 2 * a, 1.0), q))


def braking_way(v, A, T, level):
    """How far joints with v go until they rest at the end of a tick, (joints,)."""
    way = np.zeros(len(v))
    brake(np.abs(v), spread(A, len(v)), spread(T, len(v)), level == "acceleration", way)
    return way


@compiled
def brake(speed, A, T, acceleration, way):
    for j in range(len(speed)):
        while speed[j] > 0.0:  # one tick after another
            slower = max(speed[j] - A[j] * T[j], 0.0)
            way[j] += (speed[j] + slower) / 2 * T[j] if acceleration else slower * T[j]
            speed[j] = slower


def random_limits(rng, joints):
    """Limits (4, joints) and periods (joints,), over orders of magnitude and some infinite."""
    period = 10 ** rng.uniform(-4, np.log10(0.05), joints)
    acceleration = 10 ** rng.uniform(-1, 3, joints)
    velocity = np.where(rng.random(joints) < 0.2, np.inf, 10 ** rng.uniform(-2, 1, joints))
    lower = rng.uniform(-4, 2, joints)
    upper = lower + 10 ** rng.uniform(-8, 1, joints) * (rng.random(joints) > 0.02)
    which = rng.random(joints)
    lower, upper = np.where(which < 0.1, -np.inf, lower), np.where(abs(which - 0.1) < 0.05, np.inf,
                                                                    upper)
    return np.array([lower, upper, velocity, acceleration]), period


def viable_starts(rng, limits, T, level):
    """States from which simulated braking stays within the limits, a third of them barely."""
    lower, upper, velocity, A = limits
    ticks = 100 if PLAIN else 3000  # of braking, at most
    v = rng.uniform(-1, 1, len(T)) * np.minimum(np.minimum(velocity, 3.0), ticks * A * T)
    for _ in range(60):  # slower until there is room to brake
        way = braking_way(v, A, T, level)
        low, high = lower + np.where(v < 0, way, 0), upper - np.where(v > 0, way, 0)
        v = np.where(low > high, v / 2, v)
    v = np.where(low > high, 0.0, v)
    low, high = np.where(low > high, lower, low), np.where(low > high, upper, high)
    low = np.where(np.isfinite(low), low, np.where(np.isfinite(high), high - 3.0, -1.0))
    high = np.where(np.isfinite(high), high, low + 3.0)
    return low + np.clip(rng.uniform(-0.25, 1.25, len(T)), 0.0, 1.0) * (high - low), v


def adversary(rng, joints, ticks):
    """Picks (ticks, joints): each joint has its own way to choose from the box."""
    up_and_down = (np.arange(ticks)[:, None] // rng.integers(1, 100, joints)) % 2
    uniform, ends = rng.random((ticks, joints)), rng.integers(0, 2, (ticks, joints))
    ways = (0.0, 1.0, uniform, ends, up_and_down)
    return np.choose(rng.integers(0, len(ways), joints), ways)


# ---- from a viable start ----------------------------------------------------------------------
@LEVELS
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("ticks", [0, 1.5, 50])
def test_no_limit_is_exceeded_whatever_is_chosen_and_however_far_ahead_it_looks(level, seed, ticks):
    rng = np.random.default_rng(seed)
    limits, period = random_limits(rng, JOINTS)
    q, v = viable_starts(rng, limits, period, level)
    Ride(q, v, limits, period, level, adversary(rng, JOINTS, TICKS), ticks * period).keeps(limits)


@LEVELS
def test_beyond_the_box_a_limit_is_exceeded_or_the_joint_cannot_stop_in_time(level):
    rng = np.random.default_rng(3)
    limits, T = random_limits(rng, JOINTS)
    lower, upper, velocity, A = limits
    q, v = viable_starts(rng, limits, T, level)
    for sign in (-1, 1):
        box = np.empty((2, JOINTS))
        write_box(q, v, np.vstack([limits, T, T]), level == "acceleration", box[0], box[1])
        more = 1e-4 * A if level == "acceleration" else 1e-4 * A * T
        x = box[(sign + 1) // 2] + sign * more
        a = x if level == "acceleration" else (x - v) / T
        w = v + a * T
        after = q + (v * T + a * T**2 / 2 if level == "acceleration" else x * T)
        rest = after + np.sign(w) * braking_way(w, A, T, level)
        assert ((rest > upper) | (rest < lower) | (abs(w) > velocity) | (abs(a) > A)).all()


@LEVELS
@pytest.mark.parametrize("period", [1e-4, 1e-3, 7e-3, 0.05])
def test_one_who_always_pushes_up_comes_to_rest_on_the_limit_without_bouncing(level, period):
    limits = np.array([[-1.0], [1.5], [2.0], [8.0]])
    ride = Ride(np.zeros(1), np.zeros(1), limits, period, level, np.ones((int(2 / period), 1)))
    ride.keeps(limits)
    assert abs(ride.q[-1, 0] - 1.5) < 1e-12
    assert abs(ride.v[-1, 0]) < 1e-11
    assert ride.v.min() > -1e-13 / period  # the rounding of q, in one tick
    assert ride.v.max() == pytest.approx(2.0)


def test_the_sides_are_as_smooth_on_a_limit_as_before_it():
    """There the last micrometre was kept by a reversal within the tick, with any acceleration."""
    rng, T, A = np.random.default_rng(4), 1e-3, 300.0
    limits = np.tile([[-1.0], [1.0], [4.0], [A], [T], [0.0]], 20000)
    q = rng.choice([-1.0, 1.0], 20000) * (1.0 + A * T**2 * rng.uniform(-1.0, 0.2, 20000))
    v, dq, dv = A * T * rng.uniform(-1.0, 1.0, 20000), *(1e-9 * rng.normal(size=(2, 20000)))
    here, there = np.empty((2, 2, 20000))
    write_box(q, v, limits, True, *here)
    write_box(q + dq, v + dv, limits, True, *there)
    assert (abs(there - here) <= abs(dq) / T**2 + 2.0 * abs(dv) / T + 1e-8).all()


# ---- with a horizon ------------------------------------------------------------------------------
def test_a_joint_that_is_found_fast_before_its_limit_brakes_gradually():
    """Without (d) the acceleration would move by A in a tick."""
    rng, T, A = np.random.default_rng(3), 1e-3, 300.0
    room, share = rng.uniform(0.01, 0.3, 500), rng.uniform(0.05, 0.7, 500)  # of A, to rest in it
    limits = spread(np.array([[-1.0], [1.0], [20.0], [A]]), 4, 500)
    q, v = 1.0 - room, np.sqrt(2.0 * A * share * room)
    ride = Ride(q, v, limits, T, "acceleration", np.ones((400, 500)), 0.05)
    steps = np.abs(np.diff(ride.v, 2, axis=0)) / T
    assert steps.max() < 0.25 * A
    assert ride.high.max() < 1.0


def test_the_side_is_a_critically_damped_approach_where_a_joint_is_slow():
    rng, H = np.random.default_rng(1), 0.05
    q, v = rng.uniform(-1.0, 1.0, 2000), rng.uniform(-3.0, 3.0, 2000)
    in_time = np.where(v > 0.0, 1.0 - q, 1.0 + q) >= abs(v) * H
    q, v = q[in_time], v[in_time]
    one = np.ones(len(q))
    low, up = Limits(-one, one, 4.0 * one, 300.0 * one, 1e-3, H).box(q, v, "acceleration")
    wide_low, wide_up = Limits(-one, one, 4.0 * one, 300.0 * one, 1e-3).box(q, v, "acceleration")
    end = 1.0 - 1e-3  # the clearance
    most = np.minimum((4.0 - v) / H, (end - q) / H**2 - 2.0 * v / H)
    least = np.maximum((-4.0 - v) / H, (-end - q) / H**2 - 2.0 * v / H)
    most, least = np.maximum(most, (-4.0 - v) / H), np.minimum(least, (4.0 - v) / H)
    np.testing.assert_allclose(up, np.clip(most, wide_low, wide_up), rtol=0, atol=1e-9)
    np.testing.assert_allclose(low, np.clip(least, wide_low, wide_up), rtol=0, atol=1e-9)


# ---- from outside -----------------------------------------------------------------------------
@LEVELS
@pytest.mark.parametrize(("seed", "ticks"), [(6, 0), (7, 0), (6, 10)])
def test_from_any_start_the_box_is_not_empty_and_the_acceleration_holds(level, seed, ticks):
    """A joint that is too fast loses A T in a tick; with a horizon, T/H of the excess."""
    rng = np.random.default_rng(seed)
    limits, T = random_limits(rng, JOINTS)
    middle = np.clip(0.0, np.maximum(limits[0], -9.0), np.minimum(limits[1], 9.0))
    q, v = middle + rng.normal(0, 2, JOINTS), rng.normal(0, 1, JOINTS) * 10 ** rng.uniform(-3, 1)
    ride = Ride(q, v, limits, T, level, adversary(rng, JOINTS, TICKS), ticks * T)
    ride.keeps_acceleration(limits)
    speed = np.abs(np.vstack([v, ride.v]))
    too_fast = np.maximum(speed[:-1] - limits[2], 0.0)
    less = np.minimum(limits[3] * T, too_fast / ticks if ticks else np.inf)
    allowed = np.maximum(limits[2], speed[:-1] - less)
    assert (speed[1:] <= allowed * (1 + SPEED)).all(), "too fast, and not getting slower"


@LEVELS
@pytest.mark.parametrize("period", [0.01, 0.05] if PLAIN else [5e-4, 2e-3, 0.05])
@pytest.mark.parametrize("velocity", [0.3, np.inf])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_joint_outside_returns_without_turning_and_in_finite_time(level, period, velocity, side):
    """Whoever returns as slowly as the box allows needs the time of a bang-bang motion."""
    rng = np.random.default_rng(9)
    limits, T = np.tile([[-50.0], [1.0], [velocity], [10.0]], 30), np.full(30, period)
    e = 10 ** rng.uniform(-9, 0, 30)
    q, v = 1.0 + e, -rng.uniform(0, 1, 30) * np.minimum(np.sqrt(5 * e), velocity)
    if side < 0:
        limits, q, v = np.array([-limits[1], -limits[0], *limits[2:]]), -q, -v
    ticks = int(np.ceil((2 * np.sqrt(1 / 10) + 1 / velocity) / period)) + 4
    for choice in ("slowest", "random"):
        picks = np.full((ticks, 30), side > 0) if choice == "slowest" else rng.random((ticks, 30))
        ride = Ride(q, v, limits, T, level, picks)
        outside = side * np.vstack([q, ride.q]) - 1.0
        assert (np.diff(outside, axis=0)[outside[:-1] > POSITION] <= 1e-15).all()
        assert (outside[-1] <= POSITION).all()
        assert (ride.speed <= max(velocity, np.sqrt(10 * 1.0) * 1.01)).all() or choice == "random"
        assert (ride.speed <= velocity * (1 + SPEED)).all()


# ---- the guard --------------------------------------------------------------------------------
@LEVELS
def test_the_clamp_answers_anything_with_a_command_of_the_box(level):
    rng = np.random.default_rng(10)
    (lower, upper, velocity, acceleration), _ = random_limits(rng, 200)
    limits = Limits(lower, upper, velocity, acceleration, 2e-3)
    for _ in range(20):
        q, v = rng.normal(0, 2, 200), rng.normal(0, 1, 200)
        low, up = limits.box(q, v, level)
        x = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1e308, 0.0, -0.3, 2.0], 200)
        given, answer = x.copy(), limits.clamp(q, v, level, x)
        np.testing.assert_array_equal(x, given)
        rest = -v / 2e-3 if level == "acceleration" else np.zeros(200)
        np.testing.assert_array_equal(answer, np.clip(np.where(np.isnan(x), rest, x), low, up))
        assert np.isfinite(answer).all()


# ---- the tasks --------------------------------------------------------------------------------
def test_the_error_is_how_far_a_joint_is_from_its_range():
    task, q = JointLimits(ROBOT, 10.0, 1e-3, margin=0.1), np.zeros(7)
    q[0], q[3] = ROBOT.upper[0], ROBOT.lower[3] - 0.2
    state = State.at(ROBOT, q)
    np.testing.assert_allclose(task.error(state), [0.1, 0, 0, 0.3, 0, 0, 0], atol=1e-15)
    assert (task.dimension, task.kind) == (7, "inequality")
    steps, beyond = StepLimits(ROBOT, 1.0, 0.5), State.at(ROBOT, q + 0.2 * (q > 0))
    np.testing.assert_allclose(steps.error(beyond), [0.1, 0, 0, 0.1, 0, 0, 0], atol=1e-15)
    np.testing.assert_array_equal(task.jacobian(state), np.eye(7))
    assert not task.jacobian_derivative(state).any()


def test_torque_rows_hold_exactly_where_inverse_dynamics_does():
    task, rng = TorqueLimits(ROBOT, fraction=0.5), np.random.default_rng(11)
    data, held = ROBOT.model.createData(), []
    for q, v in states(200):
        A, lower, upper = written(task, state_at(q, v), "acceleration", 7)
        a = rng.normal(0, 30, 7)
        torque = pin.rnea(ROBOT.model, data, q, v, a)
        np.testing.assert_allclose(A @ a - lower, torque + ROBOT.effort_limit / 2, atol=1e-11)
        np.testing.assert_allclose(upper - A @ a, ROBOT.effort_limit / 2 - torque, atol=1e-11)
        held.append((np.abs(torque) <= ROBOT.effort_limit / 2).all())
    assert 0 < sum(held) < 200, "the test has cases on one side only"
