"""A run to its end, the same bytes again, and the runs of the authors' code (data/ellipse)."""

import signal
import subprocess
import sys

import numpy as np
import pytest
from refusals import refused

import scenarios.loop.simulation
from benchmark.studies.reference_runs import EVERY, RIGHT, RUNS, differences, reference
from scenarios import load, load_run, save, simulate
from scenarios.cell.build import build
from scenarios.export import export
from scenarios.loop.recorder import Recorder
from scenarios.measure.judging import Rows, judge
from scenarios.recording.fate import Fate, levels_at

SHORT = ["control.duration=3.0"]


def test_progress_is_told_and_an_interrupted_run_keeps_what_was_run():
    def interrupt(done, total):
        if done == 1000:
            signal.raise_signal(signal.SIGINT)

    run = simulate(load("ellipse", SHORT), progress=interrupt)
    assert run.fault == "interrupted at tick 1000"
    assert run.ticks == len(run["q"]) == len(run["time_tick"]) == 1000
    seen = []
    simulate(load("ellipse", ["control.duration=1.2"]), lambda *args: seen.append(args))
    assert seen == [(0, 1200), (500, 1200), (1000, 1200), (1200, 1200)]


@pytest.mark.parametrize("within", ["stamp", "look"])
def test_a_tick_in_which_a_run_is_interrupted_is_not_part_of_it(within, monkeypatch):
    scenario = load("ellipse", ["control.duration=0.01",
                                "faults=[{kind='nan_velocity', at=0.007, duration=0.001}]"])
    whole, method = simulate(scenario), getattr(Recorder, within)
    monkeypatch.setattr(Recorder, within, lambda self, *clock: method(self, *clock) if
                        self.ticks < 7 else signal.raise_signal(signal.SIGINT))
    run = simulate(scenario)
    assert (run.fault, run.ticks, run.events) == ("interrupted at tick 7", 7, ())
    assert whole.events
    assert run["time_tick"].max() < 10.0, "no reading of a clock"
    np.testing.assert_array_equal(run["desired_position"], whole["desired_position"][:7])


@pytest.mark.parametrize(("ends", "fault"), [
    (lambda *_: signal.raise_signal(signal.SIGINT), "interrupted at tick 0"),
    (lambda *_: 1 / 0, "ZeroDivisionError: division by zero")])  # was an error of a shape
def test_a_run_that_ends_in_its_first_tick_is_saved_and_has_nothing_to_export(
        ends, fault, tmp_path):
    run = simulate(load("wipe", ["control.duration=0.01"]), audits=[ends])
    assert run.fault.startswith(fault)
    assert run["planned_force"].shape == (0, 1, 3)
    assert load_run(save(run, tmp_path / "run")).ticks == 0
    pytest.importorskip("mcap")
    refused("the recording has no tick", export, run, tmp_path / "run.mcap")


def test_what_needs_a_whole_run_is_interrupted_with_it():
    """Such as a benchmark of ticks, or the recording of problems, which tried the next run."""
    def interrupt(tick, controller):
        return signal.raise_signal(signal.SIGINT) or {}

    with pytest.raises(KeyboardInterrupt):
        scenarios.loop.simulation.uninterrupted(load("ellipse", SHORT), [interrupt])


def test_a_run_interrupted_while_its_levels_are_judged_is_kept(monkeypatch, tmp_path):
    rows = Rows.hierarchy
    monkeypatch.setattr(Rows, "hierarchy", lambda self, k: rows(self, k) if k < 5 else
                        signal.raise_signal(signal.SIGINT))
    run = load_run(save(simulate(load("ellipse", ["control.duration=0.01"])), tmp_path / "run"))
    assert (run.ticks, run.fault) == (10, "interrupted after the last tick")
    assert ((run["level_fate"] == Fate.UNKNOWN).all(axis=1) == (np.arange(10) >= 5)).all()


def test_distances_that_are_not_those_recorded_leave_levels_unknown():
    recording = simulate(load("ellipse", ["control.duration=1.5"]))
    recording.signals["control_point_distance"] += 1e-3
    judge(recording, build(recording.scenario))
    levels = levels_at(recording, [0, 700])
    assert (levels.fate == Fate.UNKNOWN).any(axis=1).all()
    assert np.isnan(levels.violation).all()


@pytest.mark.parametrize(("given", "said"), [
    ({"push": np.zeros(2)}, "signal 'push': float64 of shape (20, 2), expected numbers of shape"),
    ({"push": None}, "signal 'push': object of shape (20,)"),  # both: a run that nothing could read
    ({"orders": 1.0}, "unknown signal 'orders'"),  # could not be saved
    ({"q": np.zeros(7)}, "'q', which the loop records")])  # took its place
def test_what_an_audit_gives_that_is_no_further_signal_ends_the_run(given, said, tmp_path):
    run = simulate(load("ellipse", ["control.duration=0.02"]),
                   audits=[lambda tick, _: given if tick == 3 else {}])
    assert run.fault.startswith(f"an audit: {said}")
    assert load_run(save(run, tmp_path / "run")).ticks == 3


@pytest.mark.parametrize("name", RUNS)
def test_the_authors_runs_are_reproduced_tick_for_tick(name):
    expected, run = reference(name), simulate(load(*RUNS[name]))
    every = slice(None, None, EVERY)
    assert (run.fault, run.ticks) == (None, 5000 if name.endswith("5s") else 18850)
    np.testing.assert_allclose(run["t"][every], expected["t"], atol=1e-12)
    np.testing.assert_array_equal(run["active_control_point"][every],
                                  expected["active_control_point"])
    for of, atol in (("q", 1e-8), ("v", 1e-6), ("position_error", 1e-8), ("pointing_error", 1e-8)):
        np.testing.assert_allclose(run[of][every], expected[of], rtol=0, atol=atol)
    np.testing.assert_allclose(run["a"][9::10][:len(expected["t"]) - 1],
                               expected["a_previous"][1:], rtol=0, atol=1e-5)


@pytest.mark.parametrize("name", RIGHT)
def test_exact_derivatives_command_nearly_the_same_from_every_recorded_state(name):
    found = differences(name)
    assert len(found) == len(reference(name)["t"]) - 1
    assert max(found) < 0.1
    assert np.median(found) < 1e-3


REPEATED = {
    "ellipse": ["control.duration=0.2"], "ellipse-hqp": ["control.duration=0.05"],
    "ellipse-noisy": ["control.duration=0.1", "plant.measurement.position_noise=0.001",
                      "plant.measurement.seed=3"],
    "humanoid": ["control.duration=0.1"], "human": ["control.duration=0.1", "sensor.seed=4"]}


def bytes_of(name, folder):
    run = simulate(load(name.removesuffix("-noisy"), REPEATED[name]))
    return (save(run, folder) / "run.npz").read_bytes()


@pytest.mark.parametrize("name", REPEATED)
def test_the_same_run_is_written_as_the_same_bytes(name, tmp_path):
    if name == "human":
        pytest.importorskip("mujoco")
    first, second = (bytes_of(name, tmp_path / folder) for folder in "ab")
    assert first == second


def test_another_process_writes_the_same_bytes(tmp_path):
    mine = bytes_of("ellipse", tmp_path / "mine")
    code = ("import sys; from scenarios import load, save, simulate; "
            "save(simulate(load('ellipse', [sys.argv[2]])), sys.argv[1])")
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "other"), *REPEATED["ellipse"]],
                   check=True)
    assert (tmp_path / "other" / "run.npz").read_bytes() == mine
