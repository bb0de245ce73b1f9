"""What a user reads who wrote something wrong; most of it is in tests/data/seen/wrong*.txt."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refused

from hierarchy import Hierarchy, HierarchyError, Robot
from hierarchy.avoidance import Barrier
from hierarchy.paths import Still
from hierarchy.tasks import JointLimits, Position, SelfSeparation
from scenarios import compare, load, save, simulate
from scenarios.cli.terminal import lines
from scenarios.config import ScenarioError
from scenarios.toml_text import read_toml
from solvers import certify, explain, make, solve_ik


def test_obstacles_are_reached_by_number_or_all_at_once():
    found = load("ellipse", ["avoidance.obstacles.1.centre=[0, 0, 1]"]).avoidance.obstacles
    assert found[1].centre == (0.0, 0.0, 1.0)
    ball = {"shape": "sphere", "radius": 0.1, "centre": [1, 1, 1]}
    balls = load("ellipse", {"avoidance.obstacles.*": ball, "avoidance.obstacles.1.radius": 0.2})
    assert [one.radius for one in balls.avoidance.obstacles] == [0.1, 0.2, 0.1]
    assert ball["radius"] == 0.1  # was changed with all that stood for it


@pytest.mark.parametrize(("text", "said"), [
    ('name = "x"\n[robot\n', "line 2"), ("a = " + "[" * 5000 + "]" * 5000, "nested too deep"),
    ("\udcff", "not UTF-8"), ("", "Field required"),
    ('extends = "nowhere"', "unknown scenario 'nowhere'"),
    ('extends = "bad.toml"', "extends this file in turn"),
    ('extends = "ellipse"\nreplaces = "avoidance"', "expected a list of sections"),
    ('extends = "ellipse"\n[position]\npath = { kind = "still", point = [0.5, 0.0, 0.5] }',
     "did you mean 'position.path.position'"),
    ('replaces = ["avoidance"]', "goes with extends"),
    *((f'extends = "ellipse"\n{variants}', "variants: expected a table of tables")
      for variants in ("variants = 3", "[variants]\nwide = 3"))])
def test_a_file_that_cannot_be_read_is_named(text, said, tmp_path):
    path = tmp_path / "bad.toml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    assert "bad.toml" in refused(said, load, path, error=ScenarioError)


def test_a_file_in_a_folder_that_no_scenario_can_name_is_refused(tmp_path):
    path = tmp_path / "\udcff" / "one.toml"
    path.parent.mkdir()
    path.write_text('extends = "ellipse"\n[robot]\nmodel = "one.urdf"')
    refused("is not UTF-8: rename it", load, path)


def test_files_that_extend_each_other_a_thousand_deep_are_refused(tmp_path):
    for i in range(1000):
        base = "ellipse" if i == 0 else f"{i - 1}.toml"
        (tmp_path / f"{i}.toml").write_text(f'extends = "{base}"\n')
    refused("more than 50 files", load, tmp_path / "999.toml", error=ScenarioError)
    assert load(tmp_path / "20.toml").robot.model == "kuka_lwr"


SHORT = load("ellipse", ["control.duration=0.01"])
ROBOT = Robot.load("kuka_lwr")
HAND = Position(ROBOT.frame("end_effector"), Still([0.3, 0.5, 0.1]))
Q, SLOW = [0.9, -0.85, 0.9, 1.2, 0.97, 1.8, 0.0], JointLimits(ROBOT, 9.0, 0.01)
H = Hierarchy.from_levels([([[1.0, 0.0]], [-0.1], [0.1]), ([[1.0, 0.5]], [0.3])])


@pytest.mark.parametrize(("call", "said"), [
    (lambda: load(""), "load: expected a path, got str ''"),
    (lambda: load("ellipse", "control.period=1"), "expected a list of \"key=value\", got str"),
    (lambda: load("ellipse", ["control.duration=2\nx = 3"]), "expected one value"),
    (lambda: simulate(load("ellipse-smooth").with_resolver("tpm")),
     'needs control.resolver = "smooth", got "tpm"'),
    (lambda: simulate(SHORT, progress=3), "simulate: progress: expected a function, got int 3"),
    (lambda: simulate(SHORT, audits=3), "simulate: audits: expected an Iterable, got int 3"),
    (lambda: simulate("elipse"), "unknown scenario 'elipse'; did you mean 'ellipse'?"),
    (lambda: compare(3), "compare: expected names, files, or what `load` returns, got int 3"),
    (lambda: compare([]), "no scenario was given"),
    (lambda: compare("ellipse", "hcod"), "resolvers: expected a list of names, got str 'hcod'"),
    (lambda: compare(SHORT, ["tpm"], out=3), "compare: out: expected a path, got int 3"),
    (lambda: save("ellipse", "x"), "save: expected a Recording, got str 'ellipse'"),
    (lambda: solve_ik(ROBOT, Q, [HAND], limits="yes"), "limits: expected True, False or a task"),
    (lambda: solve_ik("kuka_lwr", Q, []), "solve_ik: robot: expected a Robot, got str 'kuka_lwr'"),
    (lambda: solve_ik(ROBOT, Q, HAND), "solve_ik: tasks: expected a Sequence"),
    (lambda: solve_ik(ROBOT, Q, ["hand"]), "solve_ik: tasks[0]: expected a Task, got str 'hand'"),
    (lambda: solve_ik(ROBOT, Q, [HAND], dt=0.0), "dt [s] = 0: expected a number > 0"),
    (lambda: solve_ik(ROBOT, Q, [HAND], memory="last"),
     "solve_ik: memory: expected a Memory, got str 'last'"),
    (lambda: solve_ik(ROBOT, Q, [replace(HAND, gain=201.0)], dt=0.01),
     "task 'position': gain = 201 1/s times the period of 0.01 s is 2.01"),
    (lambda: solve_ik(ROBOT, Q, [SelfSeparation(ROBOT.capsules, Barrier(0.02, 101.0))], dt=0.01),
     "'self-separation': rate = 101 1/s times the period of 0.01 s is 1.01; above 1 a tick may "
     "take more than the distance left, so give at most 100 1/s"),
    (lambda: solve_ik(ROBOT, Q, [HAND], dt=0.02, limits=SLOW, v=np.zeros(7)),
     "'joint limits': its period is 0.01 s, that of the "),
    (lambda: solve_ik(ROBOT, Q, [HAND], limits=SLOW), "give v, the velocity of the tick before"),
    (lambda: solve_ik(ROBOT, Q, [HAND], until=1e-6, limits=SLOW), "limits: not with until"),
    (lambda: solve_ik(ROBOT, Q, [HAND], until=1e-6, v=Q), "v: not with until"),
    (lambda: certify([], [0.0, 0.0]), "certify: h: expected a Hierarchy, got list"),
    (lambda: explain(H, make("weighted").solve(H)), "hcod"),
    (lambda: explain(H, make("hcod").solve(H), rows="ab"), "rows: expected a list of names"),
    (lambda: Hierarchy.from_levels([([[10**400]], [1.0])]), "level 1")])
def test_a_wrong_argument_is_refused_and_named(call, said):
    refused(said, call)


@pytest.mark.parametrize(("line", "caret", "mend"), [
    ("resolver = hcod", 12, 'put text in quotes: "hcod"'),
    ('resolver = "hcod', 17, "close the text with the quote"),
    ("q = [1,\nhcod]", 1, 'text in quotes: "hcod"'), ("q = [1,\nb = 2", 5, "close this ["),
    (f"x = '{80 * 'x'}' y", 61, "check the quotes"), ("a = 1\na = 2", 1, "leave out one"),
    ("[a]\n[a]", 1, "[[name]]")])
def test_a_slip_in_a_file_shows_line_caret_and_mend(line, caret, mend, tmp_path):
    file = tmp_path / "slip.toml"
    file.write_text(f"name = 'x'\n{line}\n", encoding="utf-8")
    head, shown, pointer, told = refused(mend, read_toml, file, "file", HierarchyError).splitlines()
    assert "slip.toml', line " in head
    assert any(shown.strip() in one for one in line.splitlines())
    assert pointer.index("^") == caret + 3
    assert mend in told


def test_a_file_with_a_byte_order_mark_and_names_in_any_alphabet_is_read(tmp_path):
    file = tmp_path / "größe.toml"
    file.write_bytes('extends = "ellipse"\nname = "Größe-模型"\n'.encode("utf-8-sig"))
    assert load(file).name == "Größe-模型"


def test_a_long_command_says_every_ten_seconds_how_far_it_is_and_what_is_left(capsys):
    now = [1e3]
    say = lines("ticks", clock=lambda: now[0])
    for t, done in ((0.0, 20), (6.0, 30), (12.0, 40), (18.0, 50), (24.0, 60), (60.0, 100)):
        now[0] = 1e3 + t
        say("tpm", done, 100)
    assert capsys.readouterr().err.splitlines() == ["tpm: 40 of 100 ticks, about 36 s left",
                                                    "tpm: 60 of 100 ticks, about 24 s left"]
