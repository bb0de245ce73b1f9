"""The loop for hardware: planned times, overruns, watchdog, log; on a clock made by hand."""

import gc
import os
from threading import Event, Thread
from unittest import mock

import numpy as np
import pytest

from hierarchy import Robot as Kuka
from hierarchy import Stack, State
from hierarchy.loop import Loop, Watchdog
from hierarchy.tasks import Posture
from solvers import Resolution, Status

PERIOD = 0.25  # with steps of eighths every time is exact


@pytest.fixture(autouse=True, scope="module")
def _little_to_collect():
    """A loop collects garbage before it runs: here, not in all modules."""
    gc.freeze()
    yield
    gc.unfreeze()


class Clock:
    """Time that passes only where it is told to, or by `per_look` where it is looked at."""

    def __init__(self, per_look=0.0, oversleep=0.0):
        self.now, self.per_look, self.oversleep = 100.0, per_look, oversleep
        self.slept = []

    def __call__(self):
        self.now += self.per_look
        return self.now

    def sleep(self, seconds):
        self.slept.append(seconds)
        self.now += seconds + self.oversleep


class Robot:
    """Notes what is asked of it; a tick takes the next of `durations`."""

    def __init__(self, clock=None, durations=()):
        self.clock, self.durations = clock, list(durations)
        self.times, self.sent, self.stops = [], [], 0

    def step(self, t):
        self.times.append(t)
        if self.durations:
            self.clock.now += self.durations.pop(0)
        return np.array([t, -t])

    def send(self, command):
        self.sent.append(command)

    def stop(self):
        self.stops += 1


def ran(durations, seconds=2.0, clock=None, **settings):
    clock = clock or Clock()
    robot = Robot(clock, durations)
    loop = Loop(PERIOD, clock=clock, sleep=clock.sleep, **settings)
    return robot, loop.run(robot.step, robot.stop, seconds, robot.send, record=2)


def test_the_end_of_a_wait_is_watched_where_that_was_asked_for():
    clock = Clock(per_look=1e-4, oversleep=0.01)
    _, log = ran([], clock=clock, spin=0.02)
    assert log.late.max() < 1e-3
    assert max(clock.slept) <= PERIOD - 0.02


# A tick that takes 0.625 s ends in the middle of the third period.
@pytest.mark.parametrize(("durations", "overrun", "ticks", "late", "skipped", "ended"), [
    ([0.125] * 8, "skip", range(8), [0.0] * 8, 0, "all ticks were run"),
    ([0.0, 0.625], "skip", [0, 1, 4, 5, 6, 7], [0.0] * 6, 2, "all other ticks were run"),
    ([0.0, 0.625], "catch up", range(8), [0, 0, 0.375, 0.125, 0, 0, 0, 0], 0, "all ticks were run"),
    ([0.0, 1.75], "catch up", [0, 1, 6, 7], [0, 0, 0.5, 0.25], 4, "all other ticks were run"),
    ([0.0, 0.0, 0.375], "stop", range(3), [0.0] * 3, 0, "tick 2 ended 125 ms too late")])
def test_every_tick_is_run_at_its_planned_time_and_missed_ones_as_asked(
        durations, overrun, ticks, late, skipped, ended):
    robot, log = ran(durations, overrun=overrun, behind=3)
    np.testing.assert_array_equal(log.tick, ticks)
    np.testing.assert_array_equal(log.late, late)
    np.testing.assert_array_equal(robot.times, PERIOD * log.tick)
    np.testing.assert_array_equal(log.duration[:len(durations)], durations)
    assert (log.overruns > 0) == (max(durations) > PERIOD)
    assert (log.skipped, log.ended, robot.stops) == (skipped, ended, 1)
    for name, array in log.arrays().items():
        np.testing.assert_array_equal(array, getattr(log, name))


def test_a_log_says_how_late_and_how_long_ticks_were():
    _, log = ran([0.0, 0.625], overrun="catch up")
    assert [line.split() for line in str(log).splitlines()] == [line.split() for line in (
        "8 ticks of 250 ms, 2 overruns, 0 skipped; all ticks were run",
        "late median 0.0 us p95 287500.0 us p99.9 373250.0 us max 375000.0 us",
        "duration median 0.0 us p95 406250.0 us p99.9 620625.0 us max 625000.0 us")]


@pytest.mark.parametrize("error", [ValueError("no cable"), KeyboardInterrupt()],
                         ids=["exception", "Ctrl-C"])
@pytest.mark.parametrize("where", ["step", "send"])
def test_an_exception_ends_in_a_safe_stop_and_goes_on_with_the_log_kept(error, where):
    robot, loop = Robot(), Loop(PERIOD, clock=(clock := Clock()), sleep=clock.sleep)

    def fails(_):
        if len(robot.times) == (2 if where == "step" else 3):
            raise error
        return robot.step(0.0) if where == "step" else None

    with pytest.raises(type(error)):
        loop.run(fails if where == "step" else robot.step, robot.stop, 2.0,
                 robot.send if where == "step" else fails)
    assert (robot.stops, loop.log.count) == (1, 2)
    assert loop.log.ended.startswith(f"{type(error).__name__} after 2 ticks")


def test_the_collector_of_garbage_rests_while_the_loop_runs_and_only_then():
    seen, frozen = [], gc.get_freeze_count()
    assert gc.isenabled()
    Loop(PERIOD, clock=(clock := Clock()), sleep=clock.sleep).run(
        lambda t: seen.append(gc.isenabled()), lambda: seen.append(gc.isenabled()), 0.5)
    assert seen == [False, False, False]
    Loop(PERIOD, clock=clock, sleep=clock.sleep, pause_gc=False).run(
        lambda t: seen.append(gc.isenabled()), Event, PERIOD)
    assert seen[3:] == [True]
    assert gc.isenabled()
    assert gc.get_freeze_count() == frozen > 0


def test_the_collector_rests_while_a_loop_of_any_thread_runs():
    begun, go_on, clock, seen = Event(), Event(), Clock(), []
    other = Thread(target=Loop(PERIOD, clock=(slow := Clock()), sleep=slow.sleep).run, args=(
        lambda t: begun.set() or go_on.wait(10.0), Event, PERIOD))
    other.start()
    assert begun.wait(10.0)

    def step(t):
        go_on.set()
        other.join(10.0)
        seen.append(gc.isenabled())

    Loop(PERIOD, clock=clock, sleep=clock.sleep).run(step, Event, PERIOD)
    assert (seen, gc.isenabled()) == ([False], True)


@pytest.mark.parametrize("first", [False, True], ids=["after the last tick", "after Ctrl-C"])
def test_ctrl_c_while_the_robot_is_being_stopped_stops_it_again(first):
    robot, calls, clock = Robot(), [], Clock()

    def step(t):
        if first and t > 0.0:
            raise KeyboardInterrupt
        return robot.step(t)

    def stop():
        calls.append("begun")
        if len(calls) == 1:
            raise KeyboardInterrupt
        calls.append("ended")

    with pytest.raises(KeyboardInterrupt):
        Loop(PERIOD, clock=clock, sleep=clock.sleep).run(step, stop, 0.5, robot.send)
    assert calls == ["begun", "begun", "ended"]


def test_a_priority_that_is_not_given_is_said_and_one_that_is_is_given_back():
    before = os.sched_getscheduler(0)
    _, log = ran([], priority=1)
    assert os.sched_getscheduler(0) == before
    assert all("SCHED_FIFO at priority 1" in note for note in log.notes)
    _, log = ran([], priority=10_000)
    assert "SCHED_FIFO at priority 10000 was not given" in str(log)


def test_a_watchdog_stops_once_when_it_was_not_fed_for_its_time():
    clock, robot = Clock(), Robot()
    dog = Watchdog(1.0, robot.stop, clock)
    assert dog._thread.daemon, "a stop that hangs keeps no program from ending"
    clock.now += 1.0
    assert not dog.check()
    dog.feed()
    clock.now += 1.125
    assert (dog.check(), dog.check(), robot.stops) == (True, True, 1)
    dog._over = mock.Mock(**{"wait.return_value": True})
    dog._watch()
    dog._over.wait.assert_called_once_with(0.25)  # between two looks, a quarter of its time


@pytest.mark.parametrize(("hanging", "stops", "sent"), [("step", 1, 0), ("send", 2, 1)])
def test_what_hangs_is_stopped_from_outside_and_again_where_a_command_may_have_left(
        hanging, stops, sent):
    stopped, robot = Event(), Robot()

    def hangs(value):
        assert stopped.wait(30.0)
        return value if hanging == "step" else robot.send(value)

    def stop():
        robot.stop()
        stopped.set()

    step, send = (hangs, robot.send) if hanging == "step" else (robot.step, hangs)
    log = Loop(0.001, watchdog=0.1).run(step, stop, 1.0, send)  # long enough for a busy machine
    assert (log.ended, log.count) == ("the watchdog fired in tick 0", sent)
    assert (robot.stops, len(robot.sent)) == (stops, sent)


def test_a_safe_stop_that_fails_in_the_watchdog_is_reported():
    called = Event()

    def fails():
        called.set()
        raise OSError("no answer")

    loop = Loop(0.001, watchdog=0.01)
    with pytest.raises(OSError, match="no answer"):
        loop.run(lambda t: called.wait(30.0), fails, 1.0, lambda command: None)
    assert any("safe_stop failed in the watchdog" in note for note in loop.log.notes)


@pytest.mark.parametrize(("value", "said"), [
    *((wrong, "the command is not finite") for wrong in (
        np.array([0.0, np.nan]), np.array([np.inf, 0.0]), Resolution(np.full(2, np.nan)))),
    (None, "the step returned no command"),
    (Resolution(np.ones(2), Status.ITERATION_LIMIT), "iteration limit")])
def test_a_tick_without_a_command_stops_the_robot_and_sends_nothing(value, said):
    robot, clock = Robot(), Clock()
    log = Loop(PERIOD, clock=clock, sleep=clock.sleep).run(
        lambda t: "go", lambda: None, PERIOD, lambda message: None)
    assert log.ended == "all ticks were run", "a message of the robot's own is a command"
    log = Loop(PERIOD, clock=clock, sleep=clock.sleep).run(
        lambda t: value if t >= 2 * PERIOD else robot.step(t), robot.stop, 5.0, robot.send)
    assert (len(robot.sent), robot.stops, log.count) == (2, 1, 2)
    assert said in log.ended


def test_readings_that_are_not_finite_stop_the_robot_even_if_nobody_looks_at_move():
    state, robot, clock = State(Kuka.named("kuka_lwr")), Robot(), Clock()
    stack = Stack([Posture(tuple(np.zeros(7)))], "velocity")
    assert (stack.hierarchy(state).lower == 0.0).all(), "before the first `move`"

    def step(t):
        state.move(t, np.full(7, 0.3 if t < 2 * PERIOD else np.nan), np.zeros(7))
        return stack.hierarchy(state).lower.copy()

    log = Loop(PERIOD, clock=clock, sleep=clock.sleep).run(step, robot.stop, 5.0, robot.send)
    assert (len(robot.sent), robot.stops) == (2, 1)
    assert "is not finite" in log.ended
    state.move(1.0, np.zeros(7), np.zeros(7))
    assert (stack.hierarchy(state).lower == 0.0).all()
