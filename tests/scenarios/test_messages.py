"""What a user reads who wrote something wrong: the place, the mend, the nearest name."""

import re

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError
from scenarios import load
from scenarios.cli.main import run_command
from scenarios.cli.terminal import lines
from scenarios.config.validation import doubtful_units
from scenarios.toml_text import read_toml
from solvers import Resolution, Resolver, Status

ARM = Hierarchy.from_levels([(np.eye(7)[:3], np.ones(3))])


@pytest.mark.parametrize(("line", "caret", "mend"), [
    ("resolver = hcod", 12, 'put text in quotes: "hcod"'),
    ('resolver = "hcod', 17, "close the text with the quote"),
    ("resolver = “hcod”", 12, 'straight quotes'), ("q = [1 2]", 8, "write a comma before this"),
    ("x = 0.001 s", 11, "without unit"), ("x = 1,5", 6, "a decimal point as ."),
    ('file = "C:\\models"', 13, "write / for each"), ("x = {a = 1,}", 12, "the comma before }"),
    ("a = 1\na = 2", 1, "leave out one"), ("[a]\n[a]", 1, "[[name]]")])
def test_a_slip_in_a_file_shows_line_caret_and_mend(line, caret, mend, tmp_path):
    file = tmp_path / "slip.toml"
    file.write_text(f"name = 'x'\n{line}\n", encoding="utf-8")
    with pytest.raises(HierarchyError) as error:
        read_toml(file, "scenario file", HierarchyError)
    head, shown, pointer, told = str(error.value).splitlines()
    assert "slip.toml', line " in head
    assert shown.strip() in line.splitlines()
    assert pointer.index("^") == caret + 3
    assert mend in told


def test_a_file_with_a_byte_order_mark_and_names_in_any_alphabet_is_read(tmp_path):
    file = tmp_path / "größe.toml"
    file.write_bytes('extends = "ellipse"\nname = "Größe-模型"\n'.encode("utf-8-sig"))
    assert load(file).name == "Größe-模型"


@pytest.mark.parametrize(("asked", "said"), [
    ("elipse", "did you mean 'ellipse'? The nearest of "), ("m.urdf", "'m.urdf' is a robot"),
    ("ellipse-starts", "to be run by `hierarchy sweep ellipse-starts`")])
def test_what_is_no_scenario_is_told_with_what_it_is(asked, said, capsys):
    assert run_command(["run", asked]) == 2
    text = capsys.readouterr().err
    assert said in text
    assert len(text) < 400


def test_values_in_millimetres_are_doubted():
    path = {"position.path": {"kind": "still", "position": [0.3, 0.0, 300.0]}}
    assert list(doubtful_units(load("ellipse", path))) == [
        "position.path.position.2 = 300 m: lengths are in metres, not in millimetres"]
    assert not list(doubtful_units(load("ellipse")))


def mine(returned):
    """A resolver of a plugin that returns what a function makes of a hierarchy."""
    return type("Mine", (Resolver,), {
        "name": "mine", "solve": lambda self, h, memory=None: returned(h)})()


@pytest.mark.parametrize(("returned", "error", "said"), [
    (lambda h: np.zeros(h.n), HierarchyError, "solve: expected a Resolution, got ndarray"),
    (lambda h: Resolution(1.0), HierarchyError, "x: expected an array of 7 floats, got float 1.0"),
    (lambda h: Resolution(np.zeros(3)), HierarchyError, "expected an array of 7 floats"),
    (lambda h: h.nonsense, AttributeError, "nonsense")])
def test_what_a_resolver_of_a_plugin_returns_is_judged_and_its_errors_are_shown(
        returned, error, said):
    with pytest.raises(error, match=re.escape(said)):
        mine(returned).solve(ARM)
    found = mine(lambda h: Resolution(np.full(h.n, np.nan))).solve(ARM)
    assert (found.status, found.x.any()) == (Status.NUMERICAL_FAILURE, False)


def test_a_long_command_says_every_ten_seconds_how_far_it_is_and_what_is_left(capsys):
    now = [0.0]
    say = lines("ticks", clock=lambda: now[0])
    for now[0], done in ((0.0, 0), (6.0, 10), (12.0, 20), (18.0, 30), (24.0, 40), (60.0, 100)):
        say("tpm", done, 100)
    assert capsys.readouterr().err.splitlines() == ["tpm: 20 of 100 ticks, about 48 s left",
                                                    "tpm: 40 of 100 ticks, about 36 s left"]
