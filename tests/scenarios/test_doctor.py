import json
import re
from importlib.metadata import requires

import pytest
from packaging.requirements import Requirement

from scenarios.cli import doctor
from scenarios.cli.main import run_command

pytestmark = pytest.mark.slow


def test_the_doctor_finds_all_well_here(capsys):
    assert run_command(["doctor"]) == 0
    out = capsys.readouterr().out
    assert "No problems found." in out
    assert "20 of 20 answers certified" in out
    assert "200 ticks of ellipse" in out


def test_every_requirement_is_looked_at(monkeypatch):
    monkeypatch.setattr(doctor, "_tests", lambda: iter(()))
    looked_at = " ".join(f"{one.what} {one.found}" for one in doctor.examine())
    core = [line for line in requires("task-hierarchy") if "extra" not in line]
    for line in core:
        assert re.split("[<>]", line)[0] in looked_at
    for extra in ("qp", "sim", "sweep", "export", "jax"):
        assert any(one.what == extra and one.part.startswith("extras") for one in doctor.examine())


def test_what_does_not_work_is_named_and_ends_with_1(monkeypatch, capsys):
    def broken():
        raise RuntimeError("no such kernel")

    monkeypatch.setattr(doctor, "_resolvers_agree", broken)
    assert run_command(["doctor", "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["well"] is False
    bad = [one for one in said["findings"] if one["well"] is False]
    assert [one["what"] for one in bad] == ["resolvers agree"]
    assert "RuntimeError: no such kernel" in bad[0]["found"]


def test_a_missing_package_says_how_to_get_it(monkeypatch):
    there = doctor._version
    monkeypatch.setattr(doctor, "_version", lambda package: (
        None if package in ("osqp", "mcap") else there(package)))
    found = {one.what: one for one in [*doctor._versions(), *doctor._extras()]}
    assert found["osqp"].well is False
    assert found["osqp"].remedy == "pip install osqp"
    assert found["export"].remedy == "pip install 'task-hierarchy[export]'"
    assert found["export"].well is None


def test_a_version_outside_the_range_is_not_well(monkeypatch):
    monkeypatch.setattr(doctor, "_version", lambda package: "3.3.1")
    found = doctor._imported(Requirement("html>=4,<5"))
    assert (found.well, found.remedy) == (False, "pip install 'html<5,>=4'")
