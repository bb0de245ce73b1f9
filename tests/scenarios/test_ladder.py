"""The ladder from `ellipse` to `ellipse-hqp`: one change at a time, run as one group."""

import json

import pytest

import scenarios.config.names as groups_of
from hierarchy import HierarchyError
from scenarios import compare, load
from scenarios.cli.main import run_command
from scenarios.config import ScenarioError, members, shipped_groups

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
