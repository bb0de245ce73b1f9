"""Own tasks, resolvers, robots, plants and sensors, and who may load their code."""

import copy
import pickle
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from hierarchy import Hierarchy, Robot, plugins
from scenarios import Scenario, load, load_run, simulate
from scenarios.config.sections.tasks import OwnTask
from scenarios.measure.goals import goals
from scenarios.scene.drawn import scene
from solvers import make

MODULE = '''
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from hierarchy import Robot, Task
from hierarchy.paths import Path
from hierarchy.plugins import register
from hierarchy.robot import Frame
from hierarchy.tasks import JointCoupling, Position
from scenarios.cell.plants import KinematicArm
from scenarios.draw.figures.panels import Panel
from scenarios.measure.metrics import Metric
from scenarios.recording.signals import Signal
from solvers import Resolution, Resolver, make

@register("tasks", "elbow")
def elbow(robot: Robot, joint: str, angle: float, gain: float = 2.0, name: str = "elbow"):
    return JointCoupling(robot, {joint: 1.0}, angle, gain=gain, name=name)

@register("tasks", "along")
def along(frame: Frame, path: Path, name: str):
    return Position(frame, path, name=name)

@register("resolvers", "halved")
@dataclass(frozen=True, kw_only=True)
class Halved(Resolver):
    name: ClassVar[str] = "halved"
    handles: ClassVar[str] = "inequalities"
    share: float = 0.5

    def solve(self, h, memory=None):
        return Resolution(self.share * make("hcod").solve(h).x)

@register("robots", "my_arm")
def my_arm():
    return Robot.named("kuka_lwr")

@register("plants", "weak")
class Weak(KinematicArm):
    def __init__(self, robot, q, v, period, level, share: float):
        super().__init__(robot, q, v, period, level)
        self.share = share

    def act(self, command):
        super().act(self.share * command)

@register("tasks", "brittle")
@dataclass(frozen=True)
class Brittle(Task):
    since: float
    fault: str = "1 / 0"
    name: str = "brittle"
    gain = 2.0
    dimension = 1

    def error(self, state):
        return np.array([eval(self.fault) if state.t >= self.since else 1.0 - state.q[3]])

    def jacobian(self, state):
        return np.eye(7)[3:4]

    def jacobian_derivative(self, state):
        return np.zeros((1, 7))

@register("plants", "odd")
class Odd(KinematicArm):
    def __init__(self, robot, q, v, period, level, made: str = "", then: str = ""):
        super().__init__(robot, q, v, period, level)
        self.then, self.ticks = then, 0
        exec(made)

    def act(self, command):
        super().act(command)
        self.ticks += 1
        if self.ticks > 10:
            exec(self.then)

@register("plants", "none")
def none():
    return None

X = np.zeros(7)

@register("resolvers", "kept")
class Kept(Resolver):
    name, handles = "kept", "inequalities"

    def solve(self, h, memory=None):
        X[:] = make("hcod").solve(h).x
        return Resolution(X)
'''


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch, no_plugins):
    """A folder with a plugin and a scenario."""
    (tmp_path / "doors_of_mine.py").write_text(MODULE)
    shutil.copy(Path(__file__).parents[1] / "data" / "own.toml", tmp_path)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    sys.modules.pop("doors_of_mine", None)


def add(text, folder):
    """Add lines to the plugin."""
    with (folder / "doors_of_mine.py").open("a") as module:
        module.write(f"\n{text}\n")


@pytest.mark.parametrize("what", ["check", "run", "compare"])
def test_a_file_alone_loads_no_code(what, command, folder):
    (folder / "doors_of_mine.py").write_text("raise SystemExit('this was run')")
    text = "".join(command(what, "own.toml", code=2))
    assert "own.toml: plugin 'doors_of_mine' is not allowed: a file alone loads no code" in text
    assert "add --plugin doors_of_mine to the command" in text
    assert "\n" not in text.strip()
    assert "doors_of_mine" not in sys.modules
    (folder / "doors_of_mine.py").write_text("1 / 0")
    text = "".join(command(what, "own.toml", "--plugin", "doors_of_mine", code=2))
    assert "plugin 'doors_of_mine' cannot be imported: ZeroDivisionError" in text


def test_the_kinds_of_a_plugin_are_explained(command):
    said = command("help elbow --plugin doors_of_mine").out
    assert said.startswith('[[tasks]] with kind = "elbow"')
    assert "  joint: string, required" in said
    assert "  gain: number, default 2.0" in said
    assert '\n      "elbow": ' in command("help tasks.kind --plugin doors_of_mine").out


@pytest.mark.parametrize(("annotation", "value", "made"), [
    ("Frame | None", '"joint_4"', "Frame(name='joint_4'"),
    ("list[Frame]", '["joint_1"]', "[Frame(name='joint_1'"),  # was a list of texts
    ("Path | None", "{kind = 'still', position = [1.0, 2.0, 3.0]}", "Still("),
    ("float | None", '"5"', "tasks.1.x: Input should be a valid number, got '5'"),  # was 5.0
    ("dict[str, float]", "{a = true}", "tasks.1.x.a: Input should be a valid number, got True")])
def test_keys_that_may_be_left_out_or_are_lists_are_read_as_others(annotation, value, made, folder):
    add(f'@register("tasks", "shown")\ndef shown(x: {annotation} = None):\n'
        "    raise ValueError(repr(x))", folder)
    plugins.allow("doors_of_mine")
    refused(made, lambda: simulate(load("own.toml", [
        f"tasks.1={{kind = 'shown', x = {value}}}"])))


def test_the_error_of_a_task_of_a_plugin_has_the_unit_that_its_class_says(folder):
    add("Brittle.unit, Brittle.kind = 'kg', 'inequality'", folder)
    scenario = folder / "own.toml"
    scenario.write_text(scenario.read_text().replace('"halved"', '"hcod"')
                        + '[[tasks]]\nkind = "brittle"\nsince = 9.0\n')
    plugins.allow("doors_of_mine")
    run = simulate(load("own.toml"))
    found = next(one for one in goals(run) if one.name == "brittle")
    assert (found.unit, found.asked, found.promise) == ("kg", "in its bounds", True)
    assert "Errors of tasks in kg" in [one.name for one in scene(run).series]  # was a KeyError
    assert OwnTask.of(type("Own", (), {"unit": property(lambda self: "m")})).unit == ""


def test_the_plant_and_the_resolver_of_a_plugin_do_what_they_say():
    plugins.allow("doors_of_mine")
    scenario = load("own.toml")
    run = simulate(scenario)
    joint = run["q"][:, 3]
    # The error of the elbow shrinks by gain x resolver's share x plant's share of each period.
    factor = 1.0 - 2.0 * 0.5 * 0.5 * 0.01
    np.testing.assert_allclose(1.0 - joint, (1.0 - joint[0]) * factor ** np.arange(run.ticks),
                               rtol=1e-9)
    exact = simulate(scenario.with_resolver("hcod"))
    np.testing.assert_allclose(exact["command"][0], 2.0 * run["command"][0], rtol=1e-9)


@pytest.mark.parametrize(("fault", "said"), [
    ("1 / 0", "task 'brittle': ZeroDivisionError: division by zero ({file}, line {line})"),
    ("np.linalg.inv([[0.0]])[0]", "task 'brittle': LinAlgError: Singular matrix ({file}, line "
                                  "{line})"),
    ("np.nan", "task 'brittle', row 0: lower is nan"),
    ("exit('bye')", "task 'brittle': SystemExit: bye ({file}, line {line})")])
def test_a_task_that_fails_is_named_and_what_was_run_is_kept(fault, said, command, folder):
    file, scenario = folder / "doors_of_mine.py", folder / "own.toml"
    said = said.format(file=file, line=file.read_text().partition("eval")[0].count("\n") + 1)
    asked = f'[[tasks]]\nkind = "brittle"\nfault = "{fault}"\n'
    scenario.write_text(scenario.read_text() + asked + "since = 0.1")
    text = command("run own.toml --plugin doors_of_mine --out a", code=1).err
    assert text.strip() == f"hierarchy: fault: {said} from tick 10 on (t = 0.100 s)"
    assert load_run("a").ticks == 10
    scenario.write_text(scenario.read_text().replace("since = 0.1", "since = 0.0"))
    for what in ("check", "run"):
        assert command(f"{what} own.toml --plugin doors_of_mine", code=2).err.strip() == (
            f"hierarchy: error: own.toml: {said}")


def with_plant(folder, keys):
    """Give the scenario another plant."""
    scenario = folder / "own.toml"
    scenario.write_text(scenario.read_text().replace('"weak", share = 0.5', keys))


@pytest.mark.parametrize(("keys", "said"), [
    ('"odd", made = "self.q = None"', "'odd': q: expected 7 finite numbers, got NoneType None"),
    ('"odd", made = "self.a = np.zeros(9)"', "'odd': a: expected 7 finite numbers, got ndarray"),
    ('"odd", made = "self.extra = None"', "'odd': extra: expected a Mapping, got NoneType None"),
    ('"odd", made = "self.extra = {\'push\': np.zeros(2)}"', "'odd': extra: signal 'push': float64 "
     "of shape (1, 2), expected numbers of shape (1, 3)"),  # a run that nothing could read
    ('"odd", made = "self.extra = {\'fault\': np.zeros(1)}"', "extra: unknown signal 'fault'"),
    ('"odd", made = "self.extra = {\'q\': self.q}"', "extra: 'q', which the loop records"),
    ('"none"', "'none': NoneType None has no method act")])
def test_what_is_no_plant_is_refused_before_the_run(keys, said, command, folder):
    with_plant(folder, keys)
    text = command("run own.toml --plugin doors_of_mine --out a", code=2).err
    assert "own.toml: plant of kind '" in text
    assert said in text
    assert text.count("\n") == 1


@pytest.mark.parametrize(("fault", "said"), [
    ("1 / 0", "plant of kind 'odd': ZeroDivisionError: division by zero"),
    ("self.a = np.zeros(9)", "plant of kind 'odd': a or extra has changed: could not broadcast "
     "input array from shape (9,) into shape (7,)"),  # was written over other memory
    ("self.fault = np.ones(2)", "ValueError: The truth value of an array"),
    ("self.fault = 'it fell'", "it fell")])
def test_a_plant_that_fails_is_named_and_what_was_run_is_kept(fault, said, command, folder):
    with_plant(folder, f'"odd", then = "{fault}"')
    text = command("run own.toml --plugin doors_of_mine --out a", code=1).err
    assert text.startswith(f"hierarchy: fault: {said}")
    assert "from tick 10 on" in text
    assert load_run("a").ticks in (10, 11)


def test_arrays_that_a_plugin_keeps_and_overwrites_are_its_own(command, folder):
    with_plant(folder, '"odd", then = "command[:] = 99.0"')
    command("run own.toml --plugin doors_of_mine --resolver kept --out a")
    command("run own.toml --plugin doors_of_mine --resolver hcod --set plant.then=pass --out b")
    np.testing.assert_array_equal(load_run("a")["command"], load_run("b")["command"])
    h = Hierarchy.from_levels([(np.eye(7), np.arange(7.0))])
    first = make("kept").solve(h)
    make("kept").solve(h.changed(lower=-h.lower, upper=-h.upper))
    assert first.x[6] == pytest.approx(6.0)


@pytest.mark.parametrize(("body", "said"), [
    ("exit(4)", "metrics 'own' are left out: SystemExit: 4"),
    ("yield Metric('stack_changes', 'S', 77.0, '')", "metrics 'own' are left out: others yield "
     "'stack_changes' too"),
    ("yield from [Metric('own', 'O', 77.0, '')] * 2", "are left out: others yield 'own' too"),
    ("yield recording['q'].mean()", "what it yields[0]: expected a Metric, got float64"),
    ("yield Metric('own', 'O', np.nan, '')", "'own': value = nan: expected a finite number"),
    ("yield Metric('own', 'O', 77.0, None)", "'own': unit: expected a str")])
def test_metrics_that_fail_are_left_out_and_the_run_is_kept(body, said, command, folder):
    add(f"@register('metrics', 'own')\ndef own(recording, by):\n    {body}", folder)
    with pytest.warns(UserWarning, match=re.escape(said)):
        command("run own.toml --plugin doors_of_mine --out a")
    assert '"value": 77.0' not in (folder / "a" / "metrics.json").read_text()


def test_a_plant_that_reports_contacts_without_their_depth_keeps_its_run(command, folder):
    with_plant(folder, '"odd", made = "self.extra = {\'contacts\': np.zeros(())}"')
    with pytest.warns(UserWarning, match="'contacts' are left out: unknown signal 'contact_depth'"):
        command("run own.toml --plugin doors_of_mine --out a")
    assert not load_run("a")["contacts"].any()


def test_a_finished_run_of_a_plugin_is_opened_with_the_plugin_only(command):
    command("run own.toml --plugin doors_of_mine --out a")
    plugins._loaded.clear()
    plugins._flagged.clear()
    sys.modules.pop("doors_of_mine")
    assert "--plugin doors_of_mine" in "".join(command("export a", code=2))
    command("export a --plugin doors_of_mine")


def test_a_scenario_with_own_kinds_is_copied_and_pickled(folder):
    plugins.allow("doors_of_mine")
    before = plugins.fingerprint()
    (folder / "beside.py").touch()
    assert plugins.fingerprint() == before
    (folder / "doors_of_mine.py").write_text(MODULE + "#")
    assert plugins.fingerprint() != before
    scenario = load("own.toml")
    assert pickle.loads(pickle.dumps(scenario)) == copy.deepcopy(scenario) == scenario
    assert Scenario.from_toml(scenario.to_toml()) == scenario


@pytest.mark.parametrize(("change", "said"), [
    ("tasks.0.angel=1", "unknown key 'tasks.0.angel'; did you mean 'tasks.0.angle'? Known: angle,"),
    ("tasks.0.angle=true", "tasks.0.angle: Input should be a valid number, got True"),
    ("tasks.1.path.kind=spiral", "tasks.1.path: unknown kind 'spiral'. Known: circle"),
    ("tasks.0.kind=elbwo", "tasks.0: unknown kind 'elbwo'; did you mean 'elbow'?"),
    ("control.resolver=havled", "unknown resolver 'havled'; did you mean 'halved'?"),
    ("control.options.shar=0.1", "unknown setting of halved 'shar'; did you mean 'share'?")])
def test_wrong_keys_of_own_kinds_are_named(change, said):
    plugins.allow("doors_of_mine")
    refused(said, lambda: simulate(load("own.toml", [change])))


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
    refused("plugin 'doors_of_mine' is not allowed", plugins.require, ["doors_of_mine"])
    sys.modules.pop("entry_of_mine")


@pytest.mark.parametrize(("line", "change", "said"), [
    ("register('plants', 'three')(3)", "plant.kind=three", "plant of kind 'three': TypeError: 3 is "
     "not a callable object"),
    ("register('robots', 'odd')(lambda: 1 / 0)", "robot.model=odd", "robot 'odd' of a plugin: "
     "ZeroDivisionError: division by zero"),
    *((f"register('resolvers', 'odd')({made})", "control.resolver=odd", "resolver 'odd' of a "
       f"plugin: expected a class of Resolver, got {got}")
      for made, got in (("lambda: make('hcod')", "function"), ("int", "type"))),
    ("register('resolvers', 'odd')(type('Odd', (Halved,), {'__post_init__': lambda self: 1 / 0}))",
     "control.resolver=odd", "resolver 'odd': ZeroDivisionError: division by zero"),
    ("register('resolvers', 'odd')(type('Odd', (Halved,), {'accuracy': float('nan')}))",
     "control.resolver=odd", "resolver Odd: accuracy = nan"),  # lost the run when it was saved
    ("Halved.solve = type('Odd', (Resolver,), {'name': 'odd', 'solve': lambda self, h, memory: "
     "Resolution(h.start(), 'SOLVED')}).solve", "control.resolver=halved", "resolver 'halved': "
     "status: expected a Status, got str 'SOLVED'"),
    ("register('tasks', 'odd')(type('Odd', (JointCoupling,), {'dimension': 1.5}))",
     "tasks.0={kind='odd', joints={joint_1=1.0}, value=0.1}", "task 'odd': dimension = 1.5: "
     "expected a whole number"),
    ("register('signals', 'file')(Signal('odd', 'Pa', '(T,)', ''))", "plant={kind='odd', made='"
     "self.extra = {\"file\": q[0]}'}", "signals: 'file' is registered with a Signal called 'odd'"),
    ("register('sensors', 'odd')(lambda exact: exact.measurement)", "sensor.kind=odd",
     "sensor of kind 'odd': Measurement <")])
def test_what_is_registered_and_no_such_thing_is_named(line, change, said, folder):
    add(line, folder)
    plugins.allow("doors_of_mine")
    avoiding = ["avoidance={kind = 'separation', obstacles = [{centre = [0.6, 0.6, 0.6]}]}"]
    refused(said, lambda: simulate(load("own.toml", [change, *avoiding * ("sensor" in change)])))


@pytest.mark.parametrize(("line", "said"), [
    ("register('resolvers', 'tpm')(Halved)", "resolvers: 'tpm' is already"),  # was ignored
    ("register('robots', 'kuka_lwr')(my_arm)", "robots: 'kuka_lwr' is already"),  # this too
    ("from solvers.resolver import register as add; Halved.name = 'hcod'; add(Halved)",
     "resolvers: 'hcod' is already solvers.resolvers.hcod.Hcod"),  # took the place of hcod
    ("register('tasks', 'elbow')(Weak)", "tasks: 'elbow' is already"),
    ("register('task', 'odd')", "unknown group 'task'; did you mean 'tasks'"),
    ("register('tasks', 'odd')(None)", "tasks: 'odd' is None"),
    ("register('tasks', Weak)", "tasks: name: expected a str, got type"),
    ("Signal('odd', 'Pa', (3,), '')", "signal 'odd': shape: expected a str, got tuple (3,)"),
    ("Signal('odd', 'Pa', '(T,)', '', '/tf')",  # broke its messages
     "signal 'odd': topic = '/tf': expected / and a word, none of /tf, "),
    ("Signal('file', 'Pa', '(T,)', '')", "signal 'file': a name has letters, digits and \"_\"")])
def test_what_cannot_be_registered_is_refused_on_import(line, said, folder):
    add(line, folder)
    refused(f"plugin 'doors_of_mine' cannot be imported: {said}", plugins.allow, "doors_of_mine")
    assert type(make("hcod")).__name__ == "Hcod"
    refused("'./mine.py': give the name of a module", plugins.allow, "./mine.py")


def test_a_figure_that_fails_is_left_out_of_the_page(command, folder, undrawn):
    add("register('figures', 'odd')(Panel('odd', 'Odd', 'rad', 'q', lambda *_: exit(3)))\n"
        "register('robots', 'same')(Robot.named('kuka_lwr'))", folder)
    with pytest.warns(UserWarning, match="figure 'odd' is left out: SystemExit: 3"):
        command("compare own.toml --plugin doors_of_mine --resolvers hcod,tpm --out a --workers 1 "
                "--set robot.model=same")
    assert "Side by side" in (folder / "a" / "index.html").read_text()
