"""What a user sees: commands, short runs, pages, figures, exports; of keys, robots, tasks, answers.

    PYTHONPATH=.:tests/helpers python tests/helpers/seen.py     writes seen.json.gz

Only after a change that is meant. Many numbers stand as a sum, beside the last few of them.
tests/data/seen has the commands, by group; each group runs in a folder of its own.
"""

import contextlib
import csv
import dataclasses
import gzip
import io
import itertools
import json
import os
import re
import shlex
import tempfile
import warnings
import zipfile
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from traceback import walk_tb
from types import SimpleNamespace
from unittest.mock import patch

import computed
import computed_bench
import computed_runs
import numpy as np
import pinocchio as pin
import typer.main
from hand_made import asked, recording
from headless import whole
from matplotlib.colors import to_hex
from matplotlib.ticker import ScalarFormatter
from unplugged import unplugged

from hierarchy import HierarchyError, Robot, Task, jit, plugins, tasks
from hierarchy.robots import TABLES
from scenarios import Scenario, load, load_run, shipped, simulate
from scenarios import export as mcap
from scenarios.cell.plants import physics, torque
from scenarios.cell.sensors import depth_sensor
from scenarios.cli import doctor, runs, terminal
from scenarios.cli.main import run_command
from scenarios.config.distributions import Distribution
from scenarios.draw import replay
from scenarios.draw.figures import drawing, letter, palette, picture, timeline
from scenarios.draw.viewer import live, live_page
from scenarios.loop import controller, faults
from scenarios.measure import run_folder, safety
from scenarios.measure.metrics import measure
from scenarios.measure.runs import Run
from scenarios.measure.verdict import Comparison, verdict
from scenarios.problems.families import COUNT, FAMILIES, family
from scenarios.recording import blame
from scenarios.recording.facts import capsules as links
from scenarios.recording.signals import described
from scenarios.results import comparing, page, plan, pool, sampled, sampled_page, sections
from scenarios.scene.drawn import scene
from solvers import certify, explain, make, names
from solvers.problems import ANY, KINDS, Recipe, bounded, generate, structured
from solvers.problems import FAMILIES as SHAPES
from solvers.problems import family as shaped
from solvers.qp import backends

ROOT = Path(__file__).parents[2]
DATA = ROOT / "tests" / "data"
FILE = DATA / "pinned" / "seen.json.gz"
COMPUTED = computed.COMPUTED | computed_runs.COMPUTED | computed_bench.COMPUTED
ROBOTS = [*sorted((DATA / "robots").glob("*.xml")),
          *sorted((ROOT / "examples" / "robots").iterdir())]
GROUPS = {file.stem: file.read_text(encoding="utf-8").splitlines()
          for file in sorted((DATA / "seen").glob("*.txt"))}
# By scenario: seconds that are simulated.
RUNS = {"ellipse": 0.2, "ellipse-hqp": 0.2, "dual-arm": 0.1, "human-hqp": 0.1, "wipe": 0.05,
        "reach-torque-smooth": 0.02}
PLAIN = ("run ellipse", "run ellipse-hqp", "run dual-arm", "keys", "problems", "seeds",
         "shipped robots", "commands plain",
         *(f"computed {name}" for name in COMPUTED if name != "doubts"))
# What `hierarchy doctor` finds: names of modules of Python.
REQUIRED = ("json>=2", "calendar>=9", "csv", "string<2", "none>=3", "wave; sys_platform=='no'",
            *(f"{name}; extra == '{extra}'" for name, extra in (
                ("json", "robots"), ("json", "sim"), ("none", "sim"), ("none", "export"),
                ("csv", "adapters"), ("csv", "dev"), ("task-hierarchy[sim]", "all"))))
INSTALLED = {"task-hierarchy": "0.9", "json": "2.0.9", "calendar": "8.1", "csv": "3", "string": "1"}
NUMBER = r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?"


def seen_of_run(name):
    """Of one run: {what: lines or sums}."""
    run = _run(name)
    return {**_told(run), "figures": {key: figure_facts(fig) for key, fig in letter.figures([run])},
            "scene": condensed(dataclasses.asdict(scene(run, 30.0))),
            "exported": condensed([*mcap._entries(run, mcap.grouped(run))]),
            "layout": condensed(mcap.layout(run)),
            "channels": {topic: {name: str(values.shape) for name, values in group.items()}
                         for topic, group in mcap.grouped(run).items()},
            "plot": figure_facts(run.plot()), "shown": [repr(run), run._repr_html_()],
            "columns": [[name, unit] for name, (unit, _) in run.columns().items()]}


def seen_of_ticks(name):
    """Of the first ticks of one run: signals and metrics."""
    return _told(_run(name, ticks=8))


def _told(run, untold=()):
    usual = measure(run)
    return {"signals": {key: condensed(values) for key, values in run.signals.items()
                        if key not in untold},
            "metrics": {key: [one.label, one.unit, one.note, one.value]
                        for key, one in usual.items() if key not in untold},
            "early": {key: condensed([one.label, one.value, one.note]) for key, one in measure(
                run, 0.005, 0.5).items() if one != usual.get(key)},
            "verdict": [verdict(run).as_plain_data(), verdict(run).on_page()]}


def seen_of_keys():
    """Of keys of scenario files, tasks and settings of resolvers: types, bounds, defaults."""
    keys = Scenario.model_json_schema()["$defs"]
    return {"keys": {name: condensed(_undescribed(one)) for name, one in keys.items()},
            "resolvers": {name: repr(make(name)) for name in names()},
            "of plugins": {group: [*plugins.own(group)] for group in plugins.GROUPS},
            "looks": {label: [one.colour, str(one.dash)] for label, one in palette.looks([
                *names(), "tpm-published", "tpm in-order", "own", "own slack", *(
                    f"hqp {of}" for of in (*palette._VARIANTS, "proxqp"))]).items()},
            "lines": {of: str(palette.looks([f"hqp {of}"])[f"hqp {of}"].dash)
                      for of in palette._VARIANTS},
            "tasks": {name: {key: str(value) for key, value in vars(kind).items() if key[0] != "_"
                             and isinstance(value, (bool, float, int, str, tuple, type(None)))}
                      for name, kind in [*vars(tasks).items(), ("Task", Task)]
                      if isinstance(kind, type)},
            "labels": [make("weighted", strict_levels=count).label for count in (-1, 0, 2)] + [
                make("weighted", weights=(1.0, 0.5)).label],
            "signals": described().splitlines(),
            "sampling": [str(Distribution(**given)) for given in (
                {"uniform": [1, 2]}, {"normal": [1, 2]}, {"choice": [1, 2]}, {"integers": [1, 2]},
                {"around": 1}, {"around": [1, 2]})]}


def seen_of_live_page(name, **changed):
    """Of the page of a live run, after some requests: what its script reads."""
    with steadily():
        shown = live_page.LivePage(live.Live(load(name).model_copy(update=changed)))
        found = [condensed(shown.data())]
        for what, value in (
                ("resolver", "recursive"), ("pointing.alpha_d", 20.0), ("obstacle 0", [0, 0.5, 0]),
                ("path", [0.02, 0.6, 0.05]), ("speed", 2.0), ("path", [1, 2, float("inf")]),
                ("path", None), ("toggle", None), ("nothing", 1),
                ("obstacle 9", [0, 0, 0]), ("obstacle -1", [0, 0, 0]),
                ("obstacle 0", [9e9, 0, 0]), ("speed", "fast"), ("avoidance.near", 0.3),
                ("avoidance.nearly", 0.3), ("obstacle 0", "up"), ("resolver", [1]),
                ("resolver", "hcood"), ("speed", float("nan")), ("restart", None)):
            shown.answer({what: value})
            shown.step(0.02)
            found.append(condensed(shown.data()))
        return [*found, _told(shown.live.recording()), _shown_on(shown.html())]


def seen_of_answers():
    """Of what each resolver but `hqp` says of generated problems: answers and explanations."""
    equal = partial(generate, recipe=Recipe(
        joints=(2, 12), levels=(1, 6), rows=(0, 5), equalities_only=True, near_parallel=0.0))
    problems = [made(seed) for made in (generate, structured, equal, lambda seed: bounded(
        equal(seed), seed)) for seed in range(12)]
    found = {}
    for name in sorted({*names(), "smooth"} - {"hqp"}):
        for damping in (0.0, 0.05):
            resolver = make(name, damping=damping)
            for k, h in enumerate(problems):
                if (name, k) == ("smooth", 29):  # 1e-12 in the data is 1e-4 in x
                    continue
                with contextlib.suppress(HierarchyError):  # of rows that it does not handle
                    res, rows = resolver.solve(h), [f"r{i}" for i in range(h.m)]
                    found[f"{resolver.label} {damping} {k}"] = [
                        res.status.name, condensed(res.x), name == "hcod" and [
                            certify(h, res.x).certified,
                            str(explain(h, res, rows=rows if k % 2 else None))]]
    return found


def seen_of_figures():
    """Of figures of the letter, of runs by hand: pairs, one tick, names of joints as formulas."""
    names = ("ellipse-35deg-equality", "ellipse", "ellipse-velocity", "ellipse-35deg", "ellipse-3d")
    runs = [recording(load(name), v=np.full((5, 7), float(i)), active_control_point=np.full(5, 2))
            for i, name in enumerate(names)]
    speeds = letter.PANEL["joint-velocities"]
    for name in ("_{}", r"${}\q$"):
        run = recording()
        robot = dataclasses.replace(run.facts.robot, velocity_names=[*map(name.format, range(7))])
        runs.append(dataclasses.replace(run, facts=dataclasses.replace(run.facts, robot=robot)))
    pushed = load("humanoid-reach", {"control.duration": 0.01})
    pair = [simulate(pushed)]
    pair.append(dataclasses.replace(pair[0], signals={
        **pair[0].signals, "v": np.roll(pair[0]["v"], 9, axis=1)}))  # a joint has one colour
    return {**{f"{len(of)} {name}": figure_facts(fig) for of in (
                runs[:5], runs[2:3], [recording(t=[0.0, 1.0])], [recording(t=[0.0])])
               for name, fig in letter.figures(of)}, "one tick": figure_facts(
                   timeline.timeline(recording(t=[2.0]))), "joints": [
                figure_facts(letter.stacked([(run, [speeds]) for run in of], ""))
                for of in ([runs[5]], [runs[6]], pair)],
            "no tick": figure_facts(recording(t=[]).plot()),
            "nearest": picture._nearest(recording(minimal_distance=[2.0, np.nan, 1.0, 2.0, 2.0]))}


# What hangs on rounding in long runs, where several sets of rows may act.
OF_ROUNDING = "iterations", "active_set", "active_set_changes"
SCENES = ((physics, physics.scene), (torque, torque.on_floor))


@contextlib.contextmanager
def steadily():
    """Yield figures drawn meanwhile; a look at a clock moves it by 10 us, runs are made here."""
    clock, drawn = itertools.count(0.0, 1e-5).__next__, {}

    def plain(values, steps=False):
        return [*np.nan_to_num(values).shape, steps, *np.nan_to_num(values).ravel().tolist()]

    def svg(fig, title):
        drawn[f"{len(drawn)} {title}"] = figure_facts(fig)
        return title

    def write(fig, stem):
        drawn[f"{len(drawn)} {Path(stem).name}"] = figure_facts(fig)
        Path(f"{stem}.svg").touch()

    def noted(scene):
        def made(*given):
            text = scene(*given)
            drawn.setdefault(f"MJCF of {given[0].name}, {text.count('<')}", [
                [re.sub(NUMBER, "#", one), condensed([*map(float, re.findall(NUMBER, one))])]
                for one in text.split("><")])
            return text
        return made

    with contextlib.ExitStack() as stack:
        for name, instead, modules in (
                *((scene.__name__, noted(scene), (module,)) for module, scene in SCENES),
                ("perf_counter", clock, (controller, faults, depth_sensor, doctor, runs, plan)),
                ("requires", lambda _: REQUIRED, (doctor,)), ("__file__", "csv.py", (csv,)),
                ("version", lambda name: INSTALLED.get(name) or version("none"), (doctor,)),
                ("walk_tb", _places, (blame,)),
                ("sys", SimpleNamespace(version="3.11.2 (main)", version_info=(3, 11)), (doctor,)),
                ("installed", ("osqp", "proxqp").__contains__, (backends,)),
                ("REST", 0.004, (safety,)),  # [s]
                ("_EVERY", np.inf, (terminal,)),  # [s]: a slow machine prints no lines of progress
                ("cache_folder", lambda: Path("cache"), (jit,)),
                ("versions", lambda: {"python": "3"}, (run_folder, comparing, sampled,
                                                       sampled_page)),
                ("svg", svg, (page, sections, sampled_page)), ("write", write, (drawing,)),
                ("packed", plain, (replay, live_page)),
                ("time", SimpleNamespace(perf_counter=clock, monotonic=clock), (live, live_page)),
                ("get_command", cache(typer.main.get_command), (typer.main,)),  # once
                ("ended", lambda work, jobs, *_, **__: [(job, work(job)) for job in jobs],
                 (pool,))):
            for module in modules:
                stack.enter_context(patch.object(module, name, instead))
        yield drawn


def _places(traceback):
    """Frames and lines of a traceback, by the names of files; lines of the product's own are 0."""
    for frame, line in walk_tb(traceback):
        file = Path(frame.f_code.co_filename)
        yield SimpleNamespace(f_code=SimpleNamespace(co_filename=file.name),
                              f_locals=frame.f_locals, f_globals=frame.f_globals), (
            line if "tests" in file.parts else 0)


def seen_of_commands(group):
    """Of the commands of a group: exit codes, what they print and write, figures, runs."""
    found, here = {}, Path.cwd()
    with (tempfile.TemporaryDirectory() as folder, patch.dict(os.environ, {"COLUMNS": "100"}),
          steadily() as drawn, unplugged(), warnings.catch_warnings(record=True) as warned):
        warnings.simplefilter("always", UserWarning)
        os.chdir(folder)
        try:
            for line in filter(None, GROUPS[group]):
                printed = io.StringIO()
                command = line.replace("ROOT", str(ROOT))
                with (contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed),
                      patch("sys.argv", ["hierarchy", *shlex.split(command)])):
                    code = run_command(shlex.split(command))
                found[line] = [code, _cleaned(printed.getvalue(), group),
                               *(str(one.message) for one in warned)]
                warned.clear()
            found["written"] = {str(file): _written(file) for file in sorted(Path().rglob("*"))
                                if "worst" not in file.parts}
        finally:
            os.chdir(here)
    text = json.dumps({**found, "drawn": drawn}).replace(folder, "")
    return json.loads(text.replace(str(ROOT), ""))


def _cleaned(text, group=""):
    """Lines of a text, without where this is, what the code is, and what hangs on rounding."""
    text = re.sub(r"row missed: .*(?:\n  \S.*)*", partial(_row_missed, group), text)
    text = re.sub(r"(Changes of the active set) .*", r"\1", text)
    text = re.sub(r"-[0-9a-f]{6}.toml|\b[0-9a-f]{32}\b|\d+ kB", "", text.replace(str(ROOT), ""))
    return [" ".join(line.split()) for line in text.splitlines()
            if line.strip() and not line.startswith("task-hierarchy: ")]  # kernels are compiled


def _row_missed(group, found):
    """Which rows held a row back, and in which share of some ticks, hangs on rounding."""
    said = " ".join(found[0].split())
    return (said.partition("; held back")[0] if group in ("limits", "physics") else
            re.sub(r"\(\d+ %\)", "(# %)", said))


def _written(file):
    """What there is to see of a file."""
    if file.name == "run.npz" and len(file.parts) == 2:
        return _told(load_run(file.parent), OF_ROUNDING)
    if file.name == "facts.json":
        found = json.loads(file.read_text())
        del found["robot"]["model"], found["robot"]["digest"]  # which have the path of its file
        return condensed(found)
    if file.suffix == ".npz" and len(file.parts) == 2 and file.parts[0] in "pq":
        return [[one.filename, *one.date_time] for one in zipfile.ZipFile(file).infolist()]
    if file.suffix == ".json":
        found = json.loads(file.read_text())
        return {key: {name: value for name, value in one.items() if name not in OF_ROUNDING}
                if key == "metrics" else one for key, one in found.items()}
    if file.suffix not in (".html", ".csv", ".toml") or file.parent.name == "runs":
        return ""
    text = file.read_text()
    return _shown_on(whole(text) if file.suffix == ".html" else text)


def _shown_on(text):
    """Lines of a page, and what its script reads."""
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    return _cleaned(re.sub(r"<(style|script|iframe)\b.*?</\1>", "", text, flags=re.DOTALL)), (
        condensed(json.loads(data[1])) if data else "")


def seen_of_pages():
    """Of pages of comparisons by hand: with no run, of one tick, of odd names."""
    odd = asked(title="<script>alert(1)</script> & co", pointing=None, avoidance=None)
    failed = Run(odd, "hqp", "hqp", None, "HierarchyError: cannot <do>")
    runs = [Run(one, of, of, recording(one, **more)) for one, of, more in (
        (odd, "tpm", {}), (asked(), "tpm-published", {"t": [0.0]}),
        (asked(name="other"), "tpm", {"fault": "diverged at tick 5"}))]
    with steadily():
        return [_shown_on(whole(page.comparison_page(Comparison(some, "compare", {}))))
                for some in ([failed], [runs[0], failed], runs[1:2], runs[1:])]


def seen_of_problems():
    """Of five problems of each family that is not simulated: the rows."""
    return {name: [[condensed([*h.rows, h.start()]), h.names]
                   for h in family(name).half(5, 5).problems]
            for name in FAMILIES if family(name).usual == COUNT and name not in OF_PACKAGES}


def seen_of_robots():
    """Of each robot file of tests and examples: its numbers, what is said of it, and its sticks."""
    return {file.name: [
        {key: condensed(value) for key, value in robot_facts(robot).items()}, robot.missing,
        [condensed(dataclasses.astuple(one)) for one in links(Robot.from_file(file, shapes=False))]]
            for file in ROBOTS for robot in [Robot.from_file(file)]}


def robot_facts(robot):
    """Limits, rest, masses, and where all that is fixed to a body is in one posture."""
    model, data = robot.model, robot.model.createData()
    q = pin.integrate(model, robot.rest, np.sin(1.0 + np.arange(robot.n)))
    pin.forwardKinematics(model, data, q)
    pin.updateFramePlacements(model, data)
    return {
        "lower": robot.lower, "upper": robot.upper, "velocity_limit": robot.velocity_limit,
        "effort_limit": robot.effort_limit, "rest": robot.rest, "masses": robot.masses,
        "inertia": np.diag(pin.crba(model, data, q)), "gravity": pin.nonLinearEffects(
            model, data, q, np.cos(np.arange(robot.n))),
        "frames": {frame.name: [place.translation, *place.rotation]
                   for frame, place in zip(model.frames, data.oMf, strict=True)},
        "control_points": {point.name: data.oMi[point.joint].act(np.asarray(point.offset))
                           for point in robot.control_points},
        "capsules": {one.name: [*(data.oMi[one.joint].act(np.array(end, dtype=float))
                                  for end in (one.start, one.end)), one.radius]
                     for one in robot.capsules},
        "end_effector": data.oMf[model.getFrameId(robot.end_effector)].translation}


def seen_of_seeds():
    """Of many generated problems, by what made them: a sum each, as seeds in reports mean them."""
    def sums(made):
        return [condensed([*h.rows, h.sizes, h.reference])[0] for h in made]

    equalities = [structured(seed, equalities_only=True) for seed in range(40)]
    return {**{f"kind {kind}": sums(structured(seed, (kind,)) for seed in range(60))
               for kind in KINDS},
            **{f"family {name}": sums(shaped(name, seed) for seed in range(30)) for name in SHAPES},
            "any kind": sums(map(structured, range(40))), "equalities": sums(equalities),
            "bounded": sums(map(bounded, equalities, range(40))),
            "generated": sums(generate(seed, ANY) for seed in range(100))}


def seen_of_computed(name):
    """Of what functions of the library return."""
    found = COMPUTED[name]()
    return {str(key): [*map(condensed, one)] if isinstance(one, (list, tuple)) else condensed(one)
            for key, one in (found.items() if isinstance(found, dict) else enumerate(found))}


def figure_facts(fig):
    """Of each axes: what stands beside it, and of what is drawn in it look and numbers; images."""
    return [[ax.get_title(loc="left"), ax.get_xlabel(), ax.get_ylabel(), ax.get_xscale(),
             ax.get_yscale(), condensed([ax.get_xlim(), ax.get_ylim(), fig.get_size_inches()]),
             [[text.get_text(), text.get_rotation(), text.get_fontsize(), text.get_ha(),
               to_hex(text.get_color()), condensed(text.get_position())] for text in ax.texts],
             [[line.get_label(), to_hex(line.get_color()), line.get_linewidth(), line.get_marker(),
               str(line.get_linestyle()), line.get_zorder(), condensed(line.get_alpha() or 1.0),
               condensed(line.get_xydata())] for line in ax.lines],
             [[type(one).__name__, condensed([one.get_alpha() or 1.0, one.get_zorder(),
                                              one.get_linewidth()]), *(
                 [to_hex(colour, True) for colour in np.atleast_2d(colours)][:3]
                 for colours in (one.get_facecolor(), one.get_edgecolor())),
               condensed([outline(path.vertices) for path in (
                   one.get_paths() if hasattr(one, "get_paths") else [one.get_path()])])]
              for one in (*ax.patches, *ax.collections)],
             condensed([ax.axison, str(ax.get_aspect()), ax.get_xticks(), ax.get_yticks(), *(
                 one.get_major_formatter().format_ticks(one.get_majorticklocs())
                 for one in (ax.xaxis, ax.yaxis)
                 if not isinstance(one.get_major_formatter(), ScalarFormatter)), [
                 one.get_visible() for one in ax.spines.values()], [
                 (one.get_clim(), one.get_extent(), one.cmap(np.linspace(0.0, 1.0, 9)),
                  np.ma.filled(one.get_array(), 0.0)) for one in ax.images]]),
             [text.get_text() for one in (*fig.legends, *filter(None, [ax.get_legend()]), fig)
              for text in (one.texts if one is fig else one.get_texts())]] for ax in fig.axes]


def outline(vertices):
    """The coordinates of an outline, which may begin at any vertex, and ends there again."""
    return np.sort(np.unique(np.nan_to_num(vertices).round(9), axis=0), axis=0)


def condensed(value):
    """One number for all numbers in nested things, the last few of them, and the texts."""
    if isinstance(value, dict):
        return {str(key): condensed(one) for key, one in value.items()}
    if isinstance(value, list) and 0 < len(value) < 50 and isinstance(value[0], dict):
        return [*map(condensed, value)]
    numbers, texts = [], []
    _collect(value, numbers, texts)
    values = np.clip(np.nan_to_num(numbers, nan=7e7), -1e30, 1e30)
    weights = 1.0 + np.modf(0.618 * np.arange(len(values)))[0]
    total = float(f"{np.arcsinh(1e3 * values) @ weights:.9g}") if numbers else 0.0
    return [total, len(values), *(float(f"{one:.9g}") for one in values[-7:]),
            *sorted(set(texts), key=lambda text: (re.sub(NUMBER, "#", text), text))]


def _collect(value, numbers, texts):
    if isinstance(value, dict):
        for key, one in value.items():
            texts.append(str(key))
            _collect(one, numbers, texts)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiub":
        numbers += value.astype(float).ravel().tolist()
    elif isinstance(value, (list, tuple, np.ndarray)):
        for one in value:
            _collect(one, numbers, texts)
    elif isinstance(value, (int, float, np.number)):
        numbers.append(float(value))
    elif value is not None:
        texts.append(value if isinstance(value, str) else type(value).__name__)


def _undescribed(schema):
    """A schema without its sentences."""
    if isinstance(schema, list):
        return [_undescribed(one) for one in schema]
    said = ("description", "title")
    return schema if not isinstance(schema, dict) else {
        key: _undescribed(one) for key, one in schema.items() if key not in said}


def alike(found, expected):
    """Whether what is seen is as it was: numbers nearly, also those in texts."""
    if not isinstance(found, str) or not isinstance(expected, str):
        return type(found) is type(expected) and (
            found == expected or (isinstance(found, float) and _near(found, expected, 1e-7)))
    pairs = list(zip(*(re.findall(NUMBER, text) for text in (found, expected)), strict=False))
    return re.sub(NUMBER, "#", found) == re.sub(NUMBER, "#", expected) and all(
        one == other or _near(float(one), float(other), max(map(_rounding, (one, other))))
        for one, other in pairs)


def _near(found, expected, within):
    return abs(found - expected) <= max(1e-6 * abs(expected), within)


def _rounding(number):
    """What a printed number may be off: its last place, nothing if it is an integer."""
    mantissa, _, exponent = number.partition("e")
    places = len(mantissa.partition(".")[2])
    return max(1.1 * 10.0 ** (int(exponent or 0) - places), 1e-7) if places or exponent else 0.0


def _run(name, ticks=0):
    duration = ticks * load(name).control.period if ticks else RUNS[name]
    with steadily():
        return simulate(load(name, [f"control.duration={duration:.6g}"]))


OF_PACKAGES = ("panda-ellipse", "romeo", "singular-panda", "singular-romeo", "stand-g1",
               "stand-g1-smooth", "stand-go2", "stand-talos", "stand-talos-smooth")  # their robots
OTHERS = sorted({*shipped()} - {*RUNS, *OF_PACKAGES})
PARTS = {**{f"run {name}": partial(seen_of_run, name) for name in RUNS},
         **{f"ticks {name}": partial(seen_of_ticks, name) for name in OTHERS},
         **{f"commands {group}": partial(seen_of_commands, group) for group in GROUPS},
         **{f"computed {name}": partial(seen_of_computed, name) for name in COMPUTED},
         "answers": seen_of_answers, "live page": partial(seen_of_live_page, "ellipse"),
         "live page of a cone": partial(seen_of_live_page, "ellipse", position=None,
                                        avoidance=None),
         "live page of a table": partial(seen_of_live_page, "wipe"),
         "keys": seen_of_keys, "figures": seen_of_figures, "pages": seen_of_pages,
         "problems": seen_of_problems, "robots": seen_of_robots, "seeds": seen_of_seeds,
         "shipped robots": lambda: {name: robot_facts(Robot.named(name)) for name in TABLES}}


def seen(part):
    """One of the parts, as plain lists and dictionaries."""
    return json.loads(json.dumps(PARTS[part](), default=np.ndarray.tolist))


if __name__ == "__main__":
    text = json.dumps({part: seen(part) for part in PARTS})
    FILE.write_bytes(gzip.compress(text.encode(), mtime=0))
