"""Faults put into a run: every command is finite, the run says what happened, and goes on."""

import json

import numpy as np
import pytest

from scenarios import load, load_run, save, simulate
from scenarios.cell.build import build
from scenarios.measure.metrics import measure
from solvers import Status

AT, LASTS, END = 50, 60, 200  # ticks of 1 ms
# What is put into the run from the nearest tick on, its kind of trouble, after how many ticks.
FAULTS = {
    "all positions": ("nan_position", "", "not_finite", 0),
    "one position": ("nan_position", "joint=3", "not_finite", 0),
    "all velocities": ("nan_velocity", "", "not_finite", 0),
    "one velocity": ("nan_velocity", "joint=7", "not_finite", 0),
    "all distances": ("nan_distance", "", "not_finite", 0),
    "the distance of the end effector": ("nan_distance", "point=9", "not_finite", 0),
    "stale": ("stale", "", "stale", 20),  # the last measurement is one tick old already
    **{status: ("status", f"status={status!r}", status, 0) for status in (
        "iteration_limit", "numerical_failure", "backend_failure", "inaccurate")},
    "overrun": ("overrun", "takes=60.0", "overrun", 0),
    "obstacle": ("obstacle", "place={joint='joint_4', offset=[0.0, 0.0, 0.0]}, radius=0.05",
                 "inside", 0),
    "obstacle at a frame": ("obstacle", "place={frame='end_effector'}, radius=0.05", "inside", 0)}


def scenario(name, put, settings, *changes, kind, policy):
    fault = ", ".join(filter(None, (f"kind='{put}', at={AT}.4e-3, duration={LASTS * 1e-3}",
                                    settings)))
    return load(name, [f"control.duration={END * 1e-3}", "control.policy.deadline=30.0",
                       f"control.policy.{kind}={policy}", f"faults=[{{{fault}}}]", *changes])


def true_motion(run):
    """q, v (ticks, n) from the start and the commands alone, whatever was measured."""
    q, v, motion = run["q"][0].copy(), run["v"][0].copy(), []
    for x in run["command"]:
        motion.append((q, v))
        if run.scenario.control.level == "velocity":
            q, v = q + x * 1e-3, x
        else:
            q, v = q + v * 1e-3 + x * 1e-6 / 2, v + x * 1e-3
    return [np.array(part) for part in zip(*motion, strict=True)]


@pytest.mark.parametrize(("fault", "policy", "name", "limited"), [
    (fault, policy, ("ellipse", "ellipse-velocity")[(i + j) % 2], (i // 2 + j) % 2 == 0)
    for i, fault in enumerate(FAULTS) for j, policy in enumerate(("brake", "hold", "stop"))])
def test_every_fault_under_every_policy(fault, policy, name, limited):
    put, settings, kind, later = FAULTS[fault]
    limits = ["limits.acceleration=10.0", "control.resolver=hcod"] * limited
    run = simulate(scenario(name, put, settings, *limits, kind=kind, policy=policy))
    assert np.isfinite([run["command"], run["q"]]).all()
    np.testing.assert_allclose(run["q"], true_motion(run)[0], rtol=0, atol=1e-9)
    if limited:
        limits = build(run.scenario).tasks.limits.limits
        for q, v, x in zip(*true_motion(run), run["command"], strict=True):
            low, up = limits.box(q, v, run.scenario.control.level)
            slack = 1e-9 * (1.0 + np.abs(low) + np.abs(up))
            assert ((low - slack <= x) & (x <= up + slack)).all()
    first = AT + later
    told = [event for event in run.events if event.kind != "beyond_limits"]
    assert (told[0].tick, told[0].kind, told[0].action) == (first, kind, policy)
    assert {event.kind for event in told} == {kind}
    if policy == "stop":
        assert run.fault == f"stopped by its policy at t = {first * 1e-3:.3f} s: {kind}"
        assert run.ticks < END
        last, v = run["command"][-1], true_motion(run)[1][-1]
        rest = v + last * 1e-3 if run.scenario.control.level == "acceleration" else last
        np.testing.assert_allclose(rest, 0.0, atol=1e-8)
        return
    assert (run.fault, run.ticks) == (None, END)
    assert [event.tick for event in told] == list(range(first, AT + LASTS))
    held = [event for event in told if event.action == "hold"]
    assert len(held) == (10 if policy == "hold" else 0)
    assert (run["status"][AT + LASTS:] == Status.SOLVED).all()
    assert np.abs(run["v"][-1]).max() > 1e-2  # it moves again


def test_what_happened_is_saved_counted_and_loaded_again(tmp_path):
    run = simulate(scenario("ellipse", "nan_position", "", kind="not_finite", policy="hold"))
    found = measure(run)
    assert (found["ticks_hold"].value, found["ticks_brake"].value) == (10, LASTS - 10)
    assert load_run(save(run, tmp_path / "run")).events == run.events
    assert json.loads((tmp_path / "run" / "metrics.json").read_text())["events"] == [
        {"kind": "not_finite", "action": action, "ticks": ticks, "first_tick": first,
         "first_time": pytest.approx(first * 1e-3)}
        for action, ticks, first in (("hold", 10, AT), ("brake", LASTS - 10, AT + 10))]
