"""What a user sees of short runs: signals, metrics, figures, pages, exports; of keys, of robots.

    PYTHONPATH=.:tests/helpers python tests/helpers/seen.py     writes seen.json.gz

Only after a change that is meant. Texts stand without their numbers, many numbers as a sum.
"""

import contextlib
import dataclasses
import gzip
import io
import json
import os
import re
import shlex
import tempfile
from functools import partial
from pathlib import Path
from unittest.mock import patch

import numpy as np
from matplotlib.colors import to_hex
from pinned import FOLDER, robot_facts

from hierarchy import HierarchyError, Robot, tasks
from scenarios import Scenario, load, shipped, simulate
from scenarios.cli.main import run_command
from scenarios.config.distributions import Distribution
from scenarios.draw.figures import letter
from scenarios.draw.replay import page as replay
from scenarios.draw.viewer import live_page
from scenarios.draw.viewer.live import Live
from scenarios.export import mcap
from scenarios.measure.comparison import Comparison
from scenarios.measure.metrics import measure
from scenarios.measure.runs import Run
from scenarios.problems.families import COUNT, FAMILIES, family
from scenarios.results import page, sampled_page, sections
from scenarios.results.sampled import Workers, compare_starts
from scenarios.scene.drawn import scene
from solvers import certify, explain, make, names
from solvers.problems import ANY, generate, structured

ROBOTS = [*sorted((FOLDER.parent / "robots").glob("*.xml")),
          *sorted((FOLDER.parents[2] / "examples" / "robots").iterdir())]
# By scenario: seconds that are simulated.
RUNS = {"ellipse": 0.2, "ellipse-hqp": 0.2, "dual-arm": 0.1, "human-hqp": 0.1, "wipe": 0.05,
        "reach-torque-smooth": 0.02}
COMMANDS = (  # none of which measures a time
    "check ellipse-hqp", "check reach-torque-smooth", "check human", "check wipe",
    *(f"check {file}" for file in ROBOTS), "problems list", "problems show HUM38")
PLAIN = ("run ellipse", "run ellipse-hqp", "run dual-arm", "page", "sampled page", "keys",
         "problems")  # need no MuJoCo


def seen_of_run(name):
    """Of one run: {what: lines or sums}."""
    run = _run(name)
    return {
        "signals": {key: condensed(values) for key, values in run.signals.items()},
        "metrics": {key: [one.label, one.unit, one.note, one.value]
                    for key, one in measure(run).items()},
        "figures": {key: figure_facts(fig) for key, fig in letter.figures([run])},
        "scene": condensed(dataclasses.asdict(scene(run, 30.0))),
        "exported": condensed([*mcap._entries(run, mcap.grouped(run))]),
        "layout": condensed(mcap.layout(run))}


def seen_of_ticks(name):
    """Of the first ticks of one run: signals and metrics."""
    run = _run(name, ticks=8)
    return {"signals": {key: condensed(values) for key, values in run.signals.items()},
            "metrics": {key: [one.note, one.value] for key, one in measure(run).items()}}


def seen_of_keys():
    """Of keys of scenario files, tasks and settings of resolvers: types, bounds, defaults."""
    keys = Scenario.model_json_schema()["$defs"]
    return {"keys": {name: condensed(_undescribed(one)) for name, one in keys.items()},
            "resolvers": {name: repr(make(name)) for name in names()},
            "tasks": {name: {one.name: str(one.default) for one in dataclasses.fields(kind)
                             if one.default is not dataclasses.MISSING}
                      for name, kind in vars(tasks).items() if dataclasses.is_dataclass(kind)},
            "labels": [make("weighted", strict_levels=count).label for count in (-1, 0, 2)],
            "sampling": [str(Distribution(**given)) for given in (
                {"uniform": [1, 2]}, {"normal": [1, 2]}, {"choice": [1, 2]}, {"integers": [1, 2]},
                {"around": 1}, {"around": [1, 2]})]}


def seen_of_live_page(name):
    """Of the page of a live run, after some requests: what its script reads."""
    def plain(values, steps=False):
        return [*np.nan_to_num(values).shape, steps, *np.nan_to_num(values).ravel().tolist()]

    with patch.object(live_page, "packed", plain), patch.object(replay, "packed", plain):
        shown = live_page.LivePage(Live(load(name)))
        found = [condensed(shown.data())]
        for asked in ({"resolver": "recursive"}, {"pointing.alpha_d": 20.0}, {"playing": False},
                      {"nothing": 1}):
            shown.answer(asked)
            shown.step(0.02)
            found.append(condensed(shown.data()))
    return found


def seen_of_answers():
    """Of what each resolver but `hqp` says of generated problems: answers and explanations."""
    problems = [generate(seed, ANY) for seed in range(12)] + [structured(s) for s in range(12)]
    found = {}
    for name in sorted({*names()} - {"hqp"}):
        for damping in (0.0, 0.05):
            resolver = make(name, damping=damping)
            for k, h in enumerate(problems):
                with contextlib.suppress(HierarchyError):  # of rows that it does not handle
                    res = resolver.solve(h)
                    found[f"{resolver.label} {damping} {k}"] = [
                        res.status.name, condensed(res.x), masked(str(explain(h, res))),
                        certify(h, res.x).certified]
    return found


def seen_of_page(name):
    """Of the page that compares two resolvers: its text, and its figures."""
    runs = [Run(run.scenario, label, label, run, None)
            for label in ("tpm", "recursive") for run in [_run(name, label)]]
    with _drawn_by(page, sections) as drawn:
        text = page.comparison_page(Comparison(runs, "hierarchy compare", {"python": "3"}))
    return {"text": _text_of(text), "figures": drawn}


def seen_of_sampled_page(name):
    """Of the page that compares two resolvers over sampled starts: its text, and its figures."""
    with (_drawn_by(sampled_page) as drawn, tempfile.TemporaryDirectory() as folder,
          patch.object(sampled_page, "versions", lambda: {"python": "3"})):
        compare_starts([load(name, ["control.duration=0.05"])], ["tpm", "augmented"], 6, 0,
                       f"{folder}/out", workers=Workers(1), command="hierarchy compare")
        text = Path(folder, "out", "index.html").read_text().replace(folder, "")
    return {"text": _text_of(re.sub("-[0-9a-f]{6}.toml", ".toml", text)), "figures": drawn}


@contextlib.contextmanager
def _drawn_by(*modules):
    """Yield what is drawn by pages, by title, in place of drawing it."""
    drawn = {}

    def svg(fig, title):
        drawn[title] = figure_facts(fig)
        return title

    with contextlib.ExitStack() as stack:
        for module in modules:
            stack.enter_context(patch.object(module, "svg", svg))
        yield drawn


def _text_of(page):
    text = re.sub(r"<(style|script|iframe)\b.*?</\1>", "", page, flags=re.DOTALL)
    return [masked(line) for line in text.splitlines() if line.strip()]


def seen_of_problems():
    """Of two problems of each family that is not simulated: the rows."""
    return {name: [[condensed([*h.rows, h.start()]), h.names]
                   for h in family(name).half(5, 2).problems]
            for name in FAMILIES if family(name).usual == COUNT and name not in OF_PACKAGES}


def seen_of_robots():
    """Of each robot file of tests and examples: its numbers, by name, and what is said of it."""
    found = {file.name: Robot.from_file(file) for file in ROBOTS}
    return {name: [{key: condensed(value) for key, value in robot_facts(robot).items()},
                   [masked(text) for text in robot.missing]] for name, robot in found.items()}


def seen_of_commands():
    """Of each command: its exit code and what it prints."""
    found = {}
    with patch.dict(os.environ, {"COLUMNS": "100"}):
        for command in COMMANDS:
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed), contextlib.redirect_stderr(printed):
                code = run_command(shlex.split(command))
            text = printed.getvalue().replace(str(FOLDER.parents[2]), "")
            found[command.split("/")[-1]] = [code, *(" ".join(masked(line).split())
                                                     for line in text.splitlines())]
    return found


def figure_facts(fig):
    """Of each axes: what stands beside it, and of what is drawn in it look and numbers."""
    return [[ax.get_title(loc="left"), ax.get_xlabel(), ax.get_ylabel(), ax.get_xscale(),
             ax.get_yscale(), condensed([ax.get_xlim(), ax.get_ylim(), fig.get_size_inches()]),
             [masked(text.get_text()) for text in ax.texts],
             [[line.get_label(), to_hex(line.get_color()), line.get_linewidth(),
               str(line.get_linestyle()), line.get_zorder(), condensed(line.get_xydata())]
              for line in ax.lines],
             [[type(one).__name__, condensed(one.get_alpha() or 1.0), [
                 to_hex(colour) for colour in np.atleast_2d(one.get_facecolor())][:3],
               condensed([path.vertices for path in one.get_paths()] if hasattr(one, "get_paths")
                         else one.get_path().vertices)] for one in (*ax.patches, *ax.collections)]]
            for ax in fig.axes]


def condensed(value):
    """One number for all numbers in nested things, beside the texts without their numbers."""
    numbers, texts = [], []
    _collect(value, numbers, texts)
    values = np.array([number if np.isfinite(number) else 7e7 for number in numbers])
    weights = 1.0 + np.modf(0.618 * np.arange(len(values)))[0]
    total = float(f"{np.arcsinh(1e3 * values) @ weights:.9g}") if numbers else 0.0
    return [total, len(values), *sorted(set(texts))] if texts else [total, len(values)]


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
        texts.append(masked(value) if isinstance(value, str) else type(value).__name__)


def _undescribed(schema):
    """A schema without its sentences."""
    if isinstance(schema, list):
        return [_undescribed(one) for one in schema]
    said = ("description", "title")
    return schema if not isinstance(schema, dict) else {
        key: _undescribed(one) for key, one in schema.items() if key not in said}


def masked(text):
    """A text without its numbers, which may differ in the last digit."""
    return re.sub(r"-?\d[\d.,]*(e-?\d+)?", "#", text)


def _run(name, resolver="", ticks=0):
    scenario = load(name)
    duration = ticks * scenario.control.period if ticks else RUNS[name]
    scenario = load(name, [f"control.duration={duration:.6g}"])
    run = simulate(scenario.with_resolver(resolver) if resolver else scenario)
    taken = 1e-4 + 1e-6 * np.arange(run.ticks)  # [s]; the true ones are others each time
    return dataclasses.replace(run, signals={
        key: taken if key.startswith("time_") else values for key, values in run.signals.items()})


OF_PACKAGES = ("panda-ellipse", "romeo", "singular-panda", "singular-romeo", "stand-g1",
               "stand-g1-smooth", "stand-go2", "stand-talos", "stand-talos-smooth")  # their robots
OTHERS = sorted({*shipped()} - {*RUNS, *OF_PACKAGES})
PARTS = {**{f"run {name}": partial(seen_of_run, name) for name in RUNS},
         **{f"ticks {name}": partial(seen_of_ticks, name) for name in OTHERS},
         "answers": seen_of_answers, "live page": partial(seen_of_live_page, "ellipse"),
         "commands": seen_of_commands, "keys": seen_of_keys,
         "page": partial(seen_of_page, "ellipse"), "problems": seen_of_problems,
         "robots": seen_of_robots, "sampled page": partial(seen_of_sampled_page, "ellipse")}


def seen(part):
    """One of the parts, as plain lists and dictionaries."""
    return json.loads(json.dumps(PARTS[part](), default=np.ndarray.tolist))


if __name__ == "__main__":
    text = json.dumps({part: seen(part) for part in PARTS})
    (FOLDER / "seen.json.gz").write_bytes(gzip.compress(text.encode(), mtime=0))
