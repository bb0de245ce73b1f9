"""Scenario files, their keys and variants; groups of scenarios and where their runs part."""

import sys
from pathlib import Path

import pytest

import scenarios.config.reading as groups_of
from hierarchy import HierarchyError
from scenarios import compare
from scenarios.config import Scenario, load, shipped
from scenarios.config.reference import keys_of, sections
from scenarios.results.plan import load_sweep


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_loads_under_its_own_name_and_reads_back_the_same(name, tmp_path):
    scenario = load(name)
    assert scenario.name == name
    assert scenario.title
    scenario.make_resolver()
    (tmp_path / "scenario.toml").write_text(scenario.to_toml())
    assert load(tmp_path / "scenario.toml") == scenario == Scenario(**dict(scenario))


def test_a_file_is_beside_the_one_that_names_it_or_in_the_working_directory_of_a_change(
        tmp_path, monkeypatch):
    (tmp_path / "base").mkdir()
    (tmp_path / "base" / "base.toml").write_text(
        'extends = "ellipse"\nname = "base"\nrobot.model = "arm.urdf"\n[avoidance]\nobstacles = '
        '[{shape = "sphere", radius = 0.1, path = {kind = "recorded", file = "motion.csv"}}]\n')
    (tmp_path / "mine.toml").write_text('extends = "base/base.toml"\nname = "mine"\n')
    monkeypatch.chdir(tmp_path / "base")
    for name in ("base.toml", "../mine.toml"):
        found = load(name, ["position.path={kind='recorded', file='path.csv'}"])
        assert [found.robot.model, found.avoidance.obstacles[0].path.file,
                found.position.path.file] == [f"{tmp_path}/base/{file}" for file in (
                    "arm.urdf", "motion.csv", "path.csv")]
    (tmp_path / "base" / "moved.toml").write_text(
        'extends = "ellipse"\nname = "moved"\nposition.path = {kind = "recorded", file = "a"}\n')
    (tmp_path / "other.toml").write_text(
        'extends = "base/moved.toml"\nname = "other"\nposition.path.file = "b.csv"\n')
    assert load("../other.toml").position.path.file == f"{tmp_path}/b.csv"  # was beside the caller
    varied = '{robot.model = {choice = ["a.urdf", "kuka_lwr"]}, "a.path.file" = {choice = ["b"]}}'
    (tmp_path / "varied.toml").write_text(f'extends = "ellipse"\nvariation = {varied}\n')
    (tmp_path / "sweep.toml").write_text(
        f'name = "sweep"\nscenarios = ["ellipse"]\nsamples = 1\nparameters = {varied}\n')
    for keys in (load("../varied.toml").variation, load_sweep("../sweep.toml").parameters):
        assert keys["robot.model"].choice == (f"{tmp_path}/a.urdf", "kuka_lwr")
        assert keys["a.path.file"].choice == (f"{tmp_path}/b",)
    assert found.with_changes({"robot.model": "c.urdf"}).robot.model == f"{tmp_path}/base/c.urdf"


def test_every_key_has_a_meaning_and_the_page_of_keys_is_as_the_program_has_them(monkeypatch):
    assert not [f"{place} {section.__name__}.{key.name}" for place, section in sections()
                for key in keys_of(section) if not key.meaning]
    monkeypatch.setattr(sys, "path", [str(Path(__file__).parents[2] / "docs" / "_ext"), *sys.path])
    import scenario_keys

    assert scenario_keys.written() == scenario_keys.PAGE.read_text(encoding="utf-8"), (
        "run `python docs/_ext/scenario_keys.py`")


@pytest.mark.parametrize(("text", "says"), [
    ("scenarios = ['ellipse']", r"group 'mine': title"),
    ("title = 'x'\nscenarios = []", r"group 'mine': scenarios"),
    ("title = 'x'\nscenarios = ['ellipse']\nresolver = 'hcod'", r"group 'mine': .*'resolver'"),
    ("title = 'x'\nscenarios = ['elipse']", r"unknown scenario 'elipse'; did you mean 'ellipse'")])
def test_a_bad_group_is_an_error_that_names_it(text, says, tmp_path, monkeypatch):
    monkeypatch.setattr(groups_of, "GROUPS", tmp_path)
    (tmp_path / "mine.toml").write_text(text)
    with pytest.raises(HierarchyError, match=says):
        compare("mine")
