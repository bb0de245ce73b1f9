"""Start-up costs: imports, compilation, the first solve, and the memory of a run.

Each number is measured in a new process.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from shutil import copytree, ignore_patterns
from time import perf_counter
from typing import Any, NamedTuple
from zipfile import ZipFile

from benchmark.report import Column, Report, Row, Section, Table, digits, tell, yes
from benchmark.solve.interface import resident

_ROOT = Path(__file__).parents[1]
_REPEATED = 5        # repetitions of short processes; the minimum counts
_KERNELS = 12        # slowest to compile, listed
_MOST = 300.0        # [MB] of a run, and of a worker

_SOLVE = """\
import sys
import numpy as np
from hierarchy import Hierarchy
from solvers import make
name, *sides = sys.argv[1:]
upper = [[3.0, 3.0]] * len(sides)
h = Hierarchy.from_levels([(np.eye(3)[:1], [1.0]), (np.eye(3)[1:], [1.0, 2.0], *upper)])
sys.exit(not make(name).solve(h).verified(h))"""
_PEERS = {  # first answers of other packages, for those that are installed
    "daqp": """\
import daqp, numpy as np
one = np.eye(3)
daqp.solve(one, np.zeros(3), one, np.ones(3), -np.ones(3), np.zeros(3, dtype=np.int32))""",
    "pink": """\
import pinocchio as pin
from pink import Configuration, solve_ik
from pink.tasks import FrameTask
model = pin.buildSampleModelManipulator()
arm = Configuration(model, model.createData(), pin.neutral(model))
hand = FrameTask(model.frames[-1].name, 1.0, 1.0)
hand.set_target_from_configuration(arm)
solve_ik(arm, [hand], 0.01, solver="daqp")""",
    "mink": """\
import mink, mujoco
arm = mink.Configuration(mujoco.MjModel.from_xml_string(
    "<mujoco><worldbody><body name='hand'><joint name='a'/><geom size='.1'/></body></worldbody>"
    "</mujoco>"))
hand = mink.FrameTask("hand", "body", 1.0, 1.0)
hand.set_target_from_configuration(arm)
mink.solve_ik(arm, [hand], 0.01, "daqp")""",
}
_TICK = """\
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.controller import Controller
controller = Controller(build(load("ellipse")))
plant = controller.cell.plant
controller.command(0.0, plant.q, plant.v)"""
_COMMAND = """\
import sys, tempfile
from scenarios.cli.main import run_command
with tempfile.TemporaryDirectory() as folder:
    if run_command([*sys.argv[1:], "--out", folder + "/run"]):
        sys.exit(1)"""
_MEMORY = f"""\
{_COMMAND}
from benchmark.solve.interface import resident
print("[", resident() / 1024.0, "]")"""
_SHORT = ("run", "ellipse", "--duration", "0.02")
_COMPILE = """\
import json, sys
from numba.core import event
with event.install_recorder("numba:compile") as recorder:
    from scenarios import load, simulate
    simulate(load("ellipse", ["control.duration=0.01"]))
events = [(at, e.is_start, e.data["dispatcher"].py_func) for at, e in recorder.buffer]
print(json.dumps([[at, start, f.__module__ + "." + f.__name__] for at, start, f in events]))"""
_WORKER = """\
import json
from scenarios import load
from benchmark.start import resident_after
from scenarios.results.pool import ended
from scenarios.results.plan import Job
text = load("ellipse", ["control.duration=0.5"]).to_toml()
jobs = [Job(str(k), text, "tpm") for k in range(20)]
print(json.dumps([found for _, found in ended(resident_after, jobs, 1)]))"""


class Case(NamedTuple):
    """Arguments of Python, the most that its start may take [s], and variables of its own.

    repeated : the smallest of so many times counts, since other load can only add to it; one run
        before them fills the caches. 0 : the first run counts.
    """

    what: str
    ceiling: float | None
    arguments: Sequence[str]
    environment: dict[str, str] = {}  # noqa: RUF012 - read only
    repeated: int = _REPEATED


def run() -> Report:
    """Measure all costs."""
    with tempfile.TemporaryDirectory() as temporary:
        rows: list[Row] = []
        for case in _cases(Path(temporary)):
            seconds, processor, said = _measured(case)
            rows.append(_row(case.what, seconds, "s", case.ceiling, processor))
            if _COMPILE in case.arguments:
                kernels = own_seconds(said)
                rows.append(_row(f"compilation of {len(kernels)} kernels", sum(kernels.values()),
                                 "s"))
    *_, (run,) = _measured(Case("memory", None, ["-c", _MEMORY, "run", "ellipse", "--duration",
                                                 "2"], repeated=0))
    *_, worker = _measured(Case("memory of a worker", None, ["-c", _WORKER], repeated=0))
    rows += [_row("hierarchy run ellipse --duration 2", run, "MB", _MOST),
             _row("a worker of a sweep of 20 runs", max(worker), "MB", _MOST),
             _row("growth over the last 15 runs", worker[-1] - worker[4], "MB")]
    slowest = ", ".join(f"{name.removeprefix('solvers.kernels.')} {s:.1f}"
                        for name, s in list(kernels.items())[:_KERNELS])
    return Report("Start-up costs", [Section("", [Table("Whole processes", rows, (
        Column("", "shown", str), Column("processor", "processor"),
        Column("ceiling", "ceiling", digits), Column("met", "met", yes)), "what")],
        f"Slowest to compile [s], without called kernels: {slowest}.")],
        {"start": rows, "compilation": [{"kernel": name, "seconds": s}
                                        for name, s in kernels.items()]})


def _cases(folder: Path) -> Iterator[Case]:
    """Yield what is timed from start to end: with compiled kernels, of a wheel in dist/, without.

    TASK_HIERARCHY_NATIVE stands for a processor for which the package has no machine code.
    """
    yield Case("python -c pass", None, ["-c", "pass"])
    yield Case("import scenarios", None, ["-c", "import scenarios"])
    yield Case("import hierarchy, solvers", None, ["-c", "import hierarchy, solvers"])
    yield Case("hierarchy --help", 0.5, ["-m", "scenarios.cli.start", "--help"])
    for name in ("hcod", "tpm"):
        yield Case(f"first answer of {name}, verified, kernels cached", 0.5, ["-c", _SOLVE, name])
    for name, code in _PEERS.items():
        if find_spec(name):
            yield Case(f"first answer of {name}", None, ["-c", code])
    yield Case("first tick of ellipse, cached", None, ["-c", _TICK])
    yield Case(f"hierarchy {' '.join(_SHORT)}", 1.5, ["-c", _COMMAND, *_SHORT])
    yield Case("the same with --figures", None, ["-c", _COMMAND, *_SHORT, "--figures"])
    for wheel in sorted(_ROOT.glob("dist/*linux*.whl"))[-1:]:
        ZipFile(wheel).extractall(folder / "wheel")
        packed = {"PYTHONPATH": str(folder / "wheel")}
        yield Case("first answer of hcod, verified, from a wheel", 0.5,
                   ["-P", "-c", _SOLVE, "hcod"], packed)
        yield Case("run of ellipse, from a wheel", 1.5, ["-P", "-c", _COMMAND, *_SHORT], packed)
    for name in ("hierarchy", "solvers", "scenarios"):
        copytree(_ROOT / name, folder / "bare" / name, ignore=ignore_patterns("objects"))
    yield Case("first answer of hcod, another processor", 12.0, ["-c", _SOLVE, "hcod"],
               {"TASK_HIERARCHY_NATIVE": "1", "NUMBA_CACHE_DIR": str(folder / "native")}, 0)
    for what, ceiling, *arguments in (("first answer of hcod", 12.0, _SOLVE, "hcod"),
                                      ("the same of inequalities", None, _SOLVE, "hcod", "upper"),
                                      ("ellipse", None, _COMPILE)):
        yield Case(f"{what}, empty cache", ceiling, ["-P", "-c", *arguments],
                   {"PYTHONPATH": str(folder / "bare"), "NUMBA_CACHE_DIR": str(folder / what)}, 0)
    yield Case("the C library, empty cache", 10.0,
               ["-m", "scenarios.cli.start", "library", "--out", str(folder / "library")],
               {"NUMBA_CACHE_DIR": str(folder / "kernels")}, 0)


def _row(what: str, value: float, unit: str, ceiling: float | None = None,
         processor: float | None = None) -> Row:
    """Return a row of the table: whether the ceiling is met, None without one."""
    return {"what": what, "value": value, "unit": unit, "ceiling": ceiling, "processor": processor,
            "met": None if ceiling is None else value <= ceiling,
            "shown": f"{value:.{2 if unit == 's' else 0}f} {unit}"}


def own_seconds(events: Sequence[Sequence[Any]]) -> dict[str, float]:
    """Return the seconds of each name without nested ones, from events (time, is start, name)."""
    own: dict[str, float] = {}
    within: list[list[float]] = []  # start of each open event, seconds of nested ones
    for at, begins, name in events:
        if begins:
            within.append([at, 0.0])
            continue
        began, inner = within.pop()
        own[name] = own.get(name, 0.0) + at - began - inner
        if within:
            within[-1][1] += at - began
    return dict(sorted(own.items(), key=lambda item: -item[1]))


def resident_after(job: Any) -> float:
    """Return the most memory [MB] that this process has had after a run of a sweep."""
    from scenarios.results.plan import outcome

    outcome(job)
    return resident() / 1024.0


def _measured(case: Case) -> tuple[float, float, Any]:
    """Return wall and processor seconds of a case, and its last line if that is a list in JSON.

    Raises RuntimeError with its output if it fails.

    It keeps bytecode, as Python does unless it is told otherwise: without, it compiles each module
    that it imports, which takes longer than all else.
    """
    tell(f"{case.what} ...")
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    kept["PYTHONPATH"] = os.pathsep.join(filter(None, [str(_ROOT), kept.get("PYTHONPATH")]))
    found = []
    for _ in range(1 + case.repeated):
        began, before = perf_counter(), _busy()
        done = subprocess.run([sys.executable, *case.arguments], capture_output=True, text=True,
                              check=False, env={**kept, **case.environment})
        found.append((perf_counter() - began, _busy() - before))
        if done.returncode != 0:
            raise RuntimeError(f"{case.arguments}: {done.stderr.strip()}")
    last = done.stdout.splitlines()[-1:]
    seconds, processor = map(min, zip(*(found[1:] or found), strict=True))
    return seconds, processor, json.loads(last[0]) if last and last[0].startswith("[") else None


def _busy() -> float:
    """Return the processor time of all processes that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
