"""What a user reads who wrote something wrong: the place, the mend, the nearest name."""

import re

import numpy as np
import pytest

from hierarchy import Hierarchy, HierarchyError
from hierarchy.gate import check_rotation
from scenarios import load
from scenarios.cli.main import run_command
from scenarios.cli.progress import lines
from scenarios.config.validation import doubtful_units
from scenarios.toml_text import read_toml
from solvers import Resolution, Resolver, Status


@pytest.fixture
def an_arm_hierarchy():
    return Hierarchy.from_levels([(np.eye(7)[:3], np.ones(3))])


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


def test_a_wrong_frame_is_told_with_file_and_key(tmp_path, capsys):
    file = tmp_path / "mine.toml"
    file.write_text('extends = "humanoid"\nname = "mine"\n[robot]\nend_effector = "left_fot"\n')
    assert run_command(["check", str(file)]) == 2
    assert "mine.toml: robot: unknown end_effector frame 'left_fot'; did you mean 'left_foot'?" in (
        capsys.readouterr().err)


def test_values_in_millimetres_are_doubted():
    path = {"position.path": {"kind": "still", "position": [0.3, 0.0, 300.0]}}
    assert list(doubtful_units(load("ellipse", path))) == [
        "position.path.position.2 = 300 m: lengths are in metres, not in millimetres"]
    assert not list(doubtful_units(load("ellipse")))


def test_a_rotation_is_told_by_how_much_it_is_off():
    c, s = np.cos(0.8).round(5), np.sin(0.8).round(5)
    rounded = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
    with pytest.raises(HierarchyError, match=r"R R\^T is 1e-05 from the identity, .* 8 digits"):
        check_rotation("task 'hand': rotation", rounded)
    with pytest.raises(HierarchyError, match="a reflection, of determinant -1"):
        check_rotation("task 'hand': rotation", np.diag([1.0, 1.0, -1.0]))


def mine(returned):
    """A resolver of a plugin that returns what a function makes of a hierarchy."""
    return type("Mine", (Resolver,), {
        "name": "mine", "solve": lambda self, h, memory=None: returned(h)})()


@pytest.mark.parametrize(("returned", "said"), [
    (lambda h: np.zeros(h.n), "solve: expected a Resolution, got ndarray"),
    (lambda h: Resolution(1.0), "solve: x: expected an array of 7 floats, got float 1.0"),
    (lambda h: Resolution(np.zeros(3)), "expected an array of 7 floats")])
def test_what_a_resolver_of_a_plugin_returns_is_judged(returned, said, an_arm_hierarchy):
    with pytest.raises(HierarchyError, match=re.escape(said)):
        mine(returned).solve(an_arm_hierarchy)


def test_a_nan_of_a_resolver_of_a_plugin_is_a_failure(an_arm_hierarchy):
    found = mine(lambda h: Resolution(np.full(h.n, np.nan))).solve(an_arm_hierarchy)
    assert found.status is Status.NUMERICAL_FAILURE
    assert (found.x == 0.0).all()


def test_errors_inside_a_resolver_of_a_plugin_are_not_hidden(an_arm_hierarchy):
    with pytest.raises(AttributeError, match="nonsense"):
        mine(lambda h: h.nonsense).solve(an_arm_hierarchy)


def told(capsys, *steps):
    """Return the lines printed for steps of (time, done) of 100."""
    now = [0.0]
    say = lines("ticks", clock=lambda: now[0])
    for t, done in steps:
        now[0] = t
        say("tpm", done, 100)
    return capsys.readouterr().err.splitlines()


def test_a_short_command_is_silent(capsys):
    assert told(capsys, (0.0, 0), (5.0, 50), (9.0, 100)) == []


def test_a_long_one_says_every_ten_seconds_how_far_it_is_and_what_is_left(capsys):
    said = told(capsys, (0.0, 0), (6.0, 10), (12.0, 20), (18.0, 30), (24.0, 40), (60.0, 100))
    assert said == ["tpm: 20 of 100 ticks, about 48 s left",
                    "tpm: 40 of 100 ticks, about 36 s left"]
