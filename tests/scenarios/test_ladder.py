"""The ladder from `ellipse` to `ellipse-hqp`: one change at a time, run as one group."""

import json

import numpy as np
import pytest
from hand_made import asked, recording

import scenarios.config.names as groups_of
from hierarchy import HierarchyError
from scenarios import compare, load
from scenarios.cli.main import run_command
from scenarios.config import ScenarioError, members
from scenarios.config.resolvers import default_resolvers
from scenarios.measure.motions import motions, partings
from scenarios.measure.runs import Run
from solvers.qp import backends


def test_compare_runs_a_group_side_by_side_each_scenario_with_its_own_resolver(
        tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run_command(["compare", "ladder", "--duration", "0.02", "--workers", "1"]) == 0
    assert "Step 2: joint limits above all tasks (tpm)" in capsys.readouterr().out
    folder = tmp_path / "runs" / "compare-ladder"
    found = json.loads((folder / "comparison.json").read_text())
    assert [run["scenario"] for run in found["runs"]] == members(["ladder"])
    assert [run["label"] for run in found["runs"]] == members(["ladder"])
    assert list(found["verdicts"]) == ["own"]
    assert "Step 6: one-sided distances in place of repulsion (hcod)" in (
        folder / "index.html").read_text()


def test_a_group_is_not_a_scenario():
    with pytest.raises(ScenarioError, match=r"'ladder' is a group .*`hierarchy compare ladder`.*"
                                            "ladder-7-cone"):
        load("ladder")


@pytest.mark.parametrize(("text", "says"), [
    ("scenarios = ['ellipse']", r"group 'mine': title"),
    ("title = 'x'\nscenarios = []", r"group 'mine': scenarios"),
    ("title = 'x'\nscenarios = ['ellipse']\nresolver = 'hcod'", r"group 'mine': .*'resolver'"),
    ("title = 'x'\nscenarios = ['elipse']", r"unknown scenario 'elipse'; did you mean 'ellipse'")])
def test_a_bad_group_is_an_error_that_names_it(text, says, tmp_path, monkeypatch):
    monkeypatch.setattr(groups_of, "LIBRARY", tmp_path)
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(HierarchyError, match=says):
        compare("mine")


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
    scenario = asked(spec)
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


NOT_SOLVED = 3 * np.eye(5, dtype=int)  # at tick 0, 1, ...


@pytest.mark.parametrize(("other", "tick", "why"), [
    ({"q": away_from(3)}, 3, "the motion magnifies the errors of each tick (declared: 1e-06)"),
    ({"q": away_from(3), "status": NOT_SOLVED[3]}, 3, "tick 3 of hqp was not solved"),
    ({"q": away_from(3), "status": NOT_SOLVED[4]}, 3, "magnifies"),
    ({"q": away_from(3), "order": np.array([0, 1, 0, 0, 0])}, 3, "another one at tick 1"),
    ({"q": away_from(2, np.nan)}, 2, "")])
def test_runs_part_at_a_tick_for_a_reason_that_is_not_after_it(other, tick, why):
    (one,) = partings([run_of("recursive"), run_of("hqp", **other)])
    assert (one.tick, one.largest) == (tick, np.inf if tick == 2 else 1e-3)
    assert f"at tick {tick} ({tick}.00 s), by " in str(one)
    assert why in one.why


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
