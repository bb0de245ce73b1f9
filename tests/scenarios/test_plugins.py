"""Own kinds, and who may load their code; of wrong ones: tests/data/seen/plugins.txt."""

import copy
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from unplugged import unplugged

from hierarchy import Hierarchy, Robot, plugins
from scenarios import Scenario, load, simulate
from scenarios.config.sections.tasks import OwnTask
from scenarios.recording.signals import described, known
from solvers import make

OWN = Path(__file__).parents[1] / "data" / "seen" / "own.toml"


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch, no_plugins):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_file_alone_loads_no_code(command, folder):
    (folder / "mine.py").write_text("raise SystemExit('this was run')")
    (folder / "own.toml").write_text(OWN.read_text().replace("own_kinds", "mine"))
    for what in ("check", "run", "compare"):
        text = "".join(command(what, "own.toml", code=2))
        assert "own.toml: plugin 'mine' is not allowed: a file alone loads no code" in text
        assert "mine" not in sys.modules


def test_the_plant_and_the_resolver_of_a_plugin_do_what_they_say():
    plugins.allow("own_kinds")
    scenario = load(OWN)
    run = simulate(scenario)
    joint = run["q"][:, 3]
    # The error of the elbow shrinks by gain x resolver's share x plant's share of each period.
    factor = 1.0 - 2.0 * 0.5 * 0.5 * 0.01
    np.testing.assert_allclose(1.0 - joint, (1.0 - joint[0]) * factor ** np.arange(run.ticks),
                               rtol=1e-9)
    exact = simulate(scenario.with_resolver("hcod"))
    np.testing.assert_allclose(exact["command"][0], 2.0 * run["command"][0], rtol=1e-9)
    assert OwnTask.of(type("Own", (), {"unit": property(lambda self: "m")})).unit == ""


def test_an_answer_that_a_plugin_keeps_and_overwrites_stays_as_it_was():
    plugins.allow("own_kinds")
    h = Hierarchy.from_levels([(np.eye(7), np.arange(7.0))])
    first = make("kept").solve(h)
    make("kept").solve(h.changed(lower=-h.lower, upper=-h.upper))
    assert first.x[6] == pytest.approx(6.0)


def test_a_finished_run_of_a_plugin_is_opened_with_the_plugin_only(command):
    with unplugged():
        command(f"run {OWN} --plugin own_kinds --out a")
    assert "--plugin own_kinds" in "".join(command("export a", code=2))
    command("export a --plugin own_kinds")


def test_a_scenario_with_own_kinds_is_copied_and_pickled_and_a_change_of_them_is_noticed(folder):
    plugins.allow("own_kinds")
    scenario = load(OWN)
    assert pickle.loads(pickle.dumps(scenario)) == copy.deepcopy(scenario) == scenario
    assert Scenario.from_toml(scenario.to_toml()) == scenario
    (folder / "mine.py").touch()
    plugins.allow("mine")
    before = plugins.fingerprint()
    (folder / "beside.py").touch()
    assert plugins.fingerprint() == before
    (folder / "mine.py").write_text("#")
    assert plugins.fingerprint() != before


@pytest.mark.parametrize(("group", "line", "use"), [
    ("resolvers", "third = entry_of_mine:Third", lambda: make("third").name),
    ("robots", "arm_of_mine = entry_of_mine:TABLE", lambda: Robot.load("arm_of_mine").name)])
def test_a_name_of_an_entry_point_is_found_without_being_imported_first(group, line, use, folder):
    (folder / "entry_of_mine.py").write_text(
        "from dataclasses import replace\nfrom hierarchy.robots import TABLES\n"
        "from solvers import Resolver\nclass Third(Resolver):\n    name, solve = 'third', None\n"
        "TABLE = replace(TABLES['kuka_lwr'], name='arm_of_mine')\n")
    info = folder / "mine-1.0.dist-info"  # as pip would
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[task_hierarchy.{group}]\n{line}\n")
    sys.path.insert(0, str(folder))
    plugins._points.cache_clear()
    assert "entry_of_mine" not in sys.modules
    assert use() == line.partition(" ")[0]
    sys.modules.pop("entry_of_mine")
    plugins._loaded.clear()
    plugins.require(["entry_of_mine"])  # installed, so allowed; another module is not
    refused("plugin 'own_kinds' is not allowed", plugins.require, ["own_kinds"])
    sys.modules.pop("entry_of_mine")


@pytest.mark.parametrize(("line", "said"), [
    ("1 / 0", "ZeroDivisionError"), ("register('resolvers', 'tpm')(Halved)", "resolvers: 'tpm' is"),
    ("register('robots', 'kuka_lwr')(my_arm)", "robots: 'kuka_lwr' is already"),  # was ignored
    ("from solvers.resolver import register as add; Halved.name = 'hcod'; add(Halved)",
     "resolvers: 'hcod' is already solvers.resolvers.hcod.Hcod"),  # took the place of hcod
    ("register('tasks', 'elbow')(Weak)", "tasks: 'elbow' is already"),
    ("register('task', 'odd')", "unknown group 'task'; did you mean 'tasks'"),
    ("register('tasks', 'more')(None)", "tasks: 'more' is None"),
    ("register('plants', 'three')(3)", "plants: 'three' is 3; register a class or a function"),
    ("register('tasks', Weak)", "tasks: name: expected a str, got type"),
    ("Signal('odd', 'Pa', (3,), '')", "signal 'odd': shape: expected a str, got tuple (3,)"),
    ("Signal('odd', 'Pa', '(T,)', '', '/tf')",  # broke its messages
     "signal 'odd': topic = '/tf': expected / and a word, none of /tf, "),
    ("Signal('file', 'Pa', '(T,)', '')", "signal 'file': a name has letters, digits and \"_\"")])
def test_what_cannot_be_registered_is_refused_on_import(line, said, folder):
    (folder / "mine.py").write_text(f"from own_kinds import *\n{line}\n")
    refused(f"plugin 'mine' cannot be imported: {said}", plugins.allow, "mine")
    assert type(make("hcod")).__name__ == "Hcod"
    plugins.register("signals", "three")(3)
    assert "strain : (T,) [Pa] of a link" in described()
    refused("signals: 'three': expected a Signal, got int 3; register a Signal", known, "three")
    refused("'./mine.py': give the name of a module", plugins.allow, "./mine.py")
