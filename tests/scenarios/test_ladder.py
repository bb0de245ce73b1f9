"""The ladder from `ellipse` to `ellipse-hqp`: one change at a time, run as one group."""

import json

import numpy as np
import pytest
from hand_made import HandMadeScenario, recording

import scenarios.config.names as groups_of
from hierarchy import HierarchyError
from scenarios import compare, load
from scenarios.cli.main import run_command
from scenarios.config import ScenarioError, members, shipped_groups
from scenarios.config.resolvers import default_resolvers
from scenarios.measure.motions import motions, partings
from scenarios.measure.runs import Run
from solvers.qp import backends

# What each step changes: a key, or a section as a whole.
STEPS = {"ladder-1-staircase": "control.resolver", "ladder-2-limits": "limits",
         "ladder-3-undamped": "control.options.damping", "ladder-4-priority": "avoidance.near",
         "ladder-5-hcod": "control.resolver", "ladder-6-barrier": "avoidance",
         "ladder-7-cone": "control.stack"}


def test_the_group_is_the_ladder_from_its_first_step_to_its_last():
    assert members(["ladder"]) == ["ellipse", *STEPS]
    assert members(["strictness", "ladder"])[:2] == ["strictness", "ellipse"]
    assert "ladder" in shipped_groups()


@pytest.mark.slow
def test_compare_runs_a_group_side_by_side_each_scenario_with_its_own_resolver(
        tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run_command(["compare", "ladder", "--duration", "0.02", "--workers", "1"]) == 0
    out = capsys.readouterr().out
    assert "Step 2: joint limits above all tasks (tpm)" in out
    assert "Step 6: one-sided distances in place of repulsion (hcod)" in out
    folder = tmp_path / "runs" / "compare-ladder"
    found = json.loads((folder / "comparison.json").read_text())
    assert [run["scenario"] for run in found["runs"]] == ["ellipse", *STEPS]
    assert [run["label"] for run in found["runs"]] == ["ellipse", *STEPS]
    assert list(found["verdicts"]) == ["own"]
    page = (folder / "index.html").read_text()
    assert "Eight scenarios, resolved each by its own resolver" in page
    assert "Step 6: one-sided distances in place of repulsion (hcod)" in page


def test_a_group_is_not_a_scenario():
    with pytest.raises(ScenarioError, match=r"'ladder' is a group .*`hierarchy compare ladder`.*"
                                            "ladder-7-cone"):
        load("ladder")


@pytest.mark.parametrize(("text", "says"), [
    ("scenarios = ['ellipse']", r"group 'mine': title"),
    ("title = 'x'\nscenarios = []", r"group 'mine': scenarios"),
    ("title = 'x'\nscenarios = ['ellipse']\nresolver = 'hcod'", r"group 'mine': .*'resolver'"),
    ("title = 'x'\nscenarios = ['elipse']", r"unknown scenario 'elipse'; did you mean 'ellipse'"),
])
def test_a_bad_group_is_an_error_that_names_it(text, says, tmp_path, monkeypatch):
    monkeypatch.setattr(groups_of, "LIBRARY", tmp_path)
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(HierarchyError, match=says):
        compare("mine")


@pytest.mark.slow
def test_a_resolver_that_cannot_resolve_a_scenario_is_not_run_and_is_named(tmp_path):
    limited = load("ellipse", {"name": "limited", "control.duration": 0.01,
                               "control.options": {}, "limits.acceleration": 20.0})
    free = load("ellipse", ["control.duration=0.01"])
    done = compare([free, limited], ["recursive", "hcod"], out=tmp_path / "a")
    assert [(run.scenario.name, run.spec) for run in done.runs] == [
        ("ellipse", "recursive"), ("ellipse", "hcod"), ("limited", "hcod")]
    assert done.refused == ("recursive is not run on limited, which asks for bounds: it resolves "
                            "equalities",)
    assert done.refused[0] in (tmp_path / "a" / "index.html").read_text()
    with pytest.raises(HierarchyError, match="recursive is not run on limited"):
        compare([limited], ["recursive"])


# Where strict resolvers part: the tick, and what was different before it.


LETTER = "tpm-published"


def run_of(spec, q=None, fault=None, **changed):
    scenario = HandMadeScenario().with_resolver(spec)
    q = np.zeros((5, 7)) if q is None else q
    return Run(scenario, spec, spec, recording(scenario, fault, q=q, **changed))


def away_from(tick, by=1e-3):
    q = np.zeros((5, 7))
    q[tick:, 2] = by
    return q


def test_runs_that_are_one_motion_are_as_far_apart_as_the_farthest_of_them():
    (one,) = motions([run_of("recursive"), run_of("hqp", away_from(1, 5e-6)),
                      run_of("hcod", away_from(1, 2e-6))])
    assert one.labels == ("recursive", "hqp", "hcod")
    assert one.apart == 5e-6


def test_the_first_tick_beyond_the_bound_is_named():
    (one,) = partings([run_of("recursive"), run_of("hqp", away_from(3))])
    assert one.tick == 3
    assert "at tick 3 (3.00 s), by 1.0e-03 rad at most" in str(one)
    assert "the motion magnifies the errors of each tick (declared: 1e-09)" in one.why


@pytest.mark.parametrize(("tick", "is_the_reason"), [(3, True), (4, False)])
def test_a_tick_is_a_reason_only_where_it_was_not_solved_before_the_runs_diverge(tick,
                                                                                 is_the_reason):
    failing = run_of("hqp", away_from(3), status=3 * (np.arange(5) == tick))
    (one,) = partings([run_of("recursive"), failing])
    assert (one.why == f"tick {tick} of hqp was not solved") == is_the_reason


def test_a_stack_switched_at_another_tick_is_the_reason():
    switched = run_of("hqp", away_from(3), order=np.array([0, 1, 0, 0, 0]))
    assert "another one at tick 1" in partings([run_of("recursive"), switched])[0].why


def test_a_run_that_is_not_finite_has_parted():
    (one,) = partings([run_of("recursive"), run_of("hqp", away_from(2, np.nan))])
    assert one.tick == 2
    assert one.largest == np.inf


def test_resolvers_that_are_not_strict_need_not_agree():
    """Neither as the one compared with, nor as the one compared."""
    assert partings([run_of(LETTER), run_of("recursive"), run_of("augmented", away_from(1))]) == []


def test_a_backend_that_is_not_installed_leaves_the_default_comparison_and_is_named(monkeypatch):
    everything, nothing = default_resolvers()
    assert not nothing
    monkeypatch.setattr(backends, "installed", lambda name: name != "daqp")
    rest, missing = default_resolvers()
    assert set(everything) - set(rest) == {"hqp:backend=daqp"}
    assert missing == {"hqp:backend=daqp": "pip install 'task-hierarchy[qp]'"}
