"""The reference of keys: complete, the same in the terminal and on the page, up to date."""

import sys
from pathlib import Path

import pytest

from scenarios.cli.main import run_command
from scenarios.config.reference import keys_of, sections

EXTENSIONS = Path(__file__).parents[2] / "docs" / "_ext"


def test_every_key_has_a_meaning():
    assert not [f"{place} {section.__name__}.{key.name}" for place, section in sections()
                for key in keys_of(section) if not key.meaning]


def test_the_page_of_keys_is_as_the_program_has_them(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(EXTENSIONS), *sys.path])
    import scenario_keys

    assert scenario_keys.written() == scenario_keys.PAGE.read_text(encoding="utf-8"), (
        "run `python docs/_ext/scenario_keys.py`")


@pytest.mark.parametrize(("asked", "said"), [
    ("avoidance.obstacles.path", ["Path of its middle", 'with kind = "waypoints"', "list: 3 × numb"
                                  "er [m], required"]),
    ("tasks.0.gain", ['[[tasks]] with kind = "pose"', "[1/s], default 10.0", "default 5.0"]),
    ("control.period", ["number > 0 ≤ 1 [s], default 0.001", "Time from tick to tick."]),
    ("start.q", ["[rad or m]"]), ("duration", ["control.duration", "faults.duration"]),
    ("run", ["Usage: hierarchy run"]), ("tasks", ["[[tasks]]"])])
def test_help_says_what_a_key_means(asked, said, capsys):
    assert run_command(["help", asked]) == 0
    text = capsys.readouterr().out
    assert all(one in text for one in said)
