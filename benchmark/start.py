"""Start-up costs: imports, compilation, the first solve, and the memory of a run.

Each number is measured in a new process.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import ZipFile

from benchmark.report import Report, Section
from benchmark.solve.questions import resident
from benchmark.store import Row
from benchmark.tables import Column, Table, digits

_ROOT = Path(__file__).parents[1]
_REPEATED = 5        # repetitions of short processes; the minimum counts
_KERNELS = 12        # slowest to compile, listed
_MB = 1024.0 if sys.platform == "linux" else 1024.0**2  # units of ru_maxrss per MB

# The peak memory of a process includes that of its parent before exec, so a small process starts
# it.
_LAUNCH = """\
import json, os, sys, time
began = time.perf_counter()
process = os.spawnv(os.P_NOWAIT, sys.argv[2], sys.argv[2:])
_, status, usage = os.wait4(process, 0)
spent = [time.perf_counter() - began, usage.ru_utime + usage.ru_stime, usage.ru_maxrss]
with open(sys.argv[1], "w") as file:
    json.dump(spent, file)
sys.exit(os.waitstatus_to_exitcode(status))"""
_SOLVE = """\
import sys
import numpy as np
from hierarchy import Hierarchy
from solvers import make
h = Hierarchy.from_levels([(np.eye(3)[:1], [1.0]), (np.eye(3)[1:], [1.0, 2.0])])
sys.exit(not make(sys.argv[1]).solve(h).verified(h))"""
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
from scenarios.config import load
from scenarios.loop.controller import Controller
controller = Controller(load("ellipse"))
plant = controller.cell.plant
controller.command(0.0, plant.q, plant.v)"""
_COMMAND = """\
import sys, tempfile
from scenarios.cli.main import run_command
with tempfile.TemporaryDirectory() as folder:
    sys.exit(run_command([*sys.argv[1:], "--out", folder + "/run"]))"""
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
from scenarios.results.run import Job
text = load("ellipse", ["control.duration=0.5"]).to_toml()
jobs = [Job(str(k), text, "tpm") for k in range(20)]
print(json.dumps([found for _, found in ended(resident_after, jobs, 1)]))"""


class Cost(NamedTuple):
    """One number and its upper limit, None for no limit.

    unit : "s" or "MB". processor : processor time [s], which does not depend on other load; None if
    it is not measured.
    """

    what: str
    value: float
    unit: str
    ceiling: float | None = None
    processor: float | None = None

    def row(self) -> Row:
        """Return the row of the table: whether the limit is met, "" without one."""
        met = "" if self.ceiling is None else "met" if self.value <= self.ceiling else "not met"
        shown = f"{self.value:.{2 if self.unit == 's' else 0}f} {self.unit}"
        return {**self._asdict(), "verdict": met, "shown": shown}


def run() -> Report:
    """Measure all costs."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        compiled, kernels = first_compilation(folder / "cache")
        costs = [*beginnings(folder), *compiled, library(folder), *memory(folder)]
    rows = [cost.row() for cost in costs]
    slowest = ", ".join(f"{name.removeprefix('solvers.kernels.')} {s:.1f}"
                        for name, s in list(kernels.items())[:_KERNELS])
    return Report("Start-up costs", [Section("", [Table("Whole processes", rows, (
        Column("", "shown", str), Column("processor", "processor"),
        Column("ceiling", "ceiling", digits), Column("", "verdict", str)), "what")],
        f"Slowest to compile [s], without called kernels: {slowest}.")],
        {"start": rows, "compilation": [{"kernel": name, "seconds": s}
                                        for name, s in kernels.items()]})


def beginnings(folder: Path) -> Iterator[Cost]:
    """Time whole processes from start to end, with compiled kernels; also of a wheel in dist/.

    The minimum of several repetitions counts, since other load can only add to it.
    """
    cases: list[tuple[str, float | None, list[str]]] = [
        ("python -c pass", None, ["-c", "pass"]),
        ("import scenarios", None, ["-c", "import scenarios"]),
        ("import hierarchy, solvers", None, ["-c", "import hierarchy, solvers"]),
        ("hierarchy --help", 0.5, ["-m", "scenarios.cli.start", "--help"]),
        *((f"first answer of {name}, verified, kernels cached", 0.5, ["-c", _SOLVE, name])
          for name in ("hcod", "tpm")),
        *((f"first answer of {name}", None, ["-c", code]) for name, code in _PEERS.items()
          if find_spec(name)),
        ("first tick of ellipse, cached", None, ["-c", _TICK]),
        (f"hierarchy {' '.join(_SHORT)}", 1.5, ["-c", _COMMAND, *_SHORT]),
        ("the same with --figures", None, ["-c", _COMMAND, *_SHORT, "--figures"])]
    for what, most, arguments in cases:
        yield _least(what, most, arguments)
    for wheel in sorted(_ROOT.glob("dist/*linux*.whl"))[-1:]:
        ZipFile(wheel).extractall(folder / "wheel")
        for what, most, arguments in (
                ("first answer of hcod, verified", 0.5, ["-c", _SOLVE, "hcod"]),
                ("run of ellipse", 1.5, ["-c", _COMMAND, *_SHORT])):
            yield _least(f"{what}, from a wheel", most, ["-P", *arguments],
                         PYTHONPATH=str(folder / "wheel"))


def _least(what: str, most: float | None, arguments: list[str], **environment: str) -> Cost:
    _say(what)
    _run(arguments, **environment)  # fills the caches of files, bytecode and kernels
    done = [_run(arguments, **environment) for _ in range(_REPEATED)]
    return Cost(what, min(one.seconds for one in done), "s", most,
                min(one.processor for one in done))


def first_compilation(cache: Path) -> tuple[list[Cost], dict[str, float]]:
    """Ask hcod and run ten ticks of ellipse without cached kernels; also each kernel's own seconds.

    Raises
    ------
    RuntimeError : the process failed.
    """
    _say("hcod and ellipse, empty caches")
    first = _run(["-c", _SOLVE, "hcod"], TASK_HIERARCHY_NATIVE="1",
                 NUMBA_CACHE_DIR=str(cache / "hcod"))
    done = _run(["-c", _COMPILE], TASK_HIERARCHY_NATIVE="1",
                NUMBA_CACHE_DIR=str(cache / "ellipse"))
    own = own_seconds(json.loads(done.said.splitlines()[-1]))
    return [Cost("first answer of hcod, empty cache", first.seconds, "s", None, first.processor),
            Cost("ellipse, empty cache", done.seconds, "s", None, done.processor),
            Cost(f"compilation of {len(own)} kernels", sum(own.values()), "s")], own


def library(folder: Path) -> Cost:
    """Make the C library without cached kernels."""
    _say("library, empty cache")
    done = _run(["-m", "scenarios.cli.start", "library", "--out", str(folder / "library")],
                NUMBA_CACHE_DIR=str(folder / "kernels"))
    return Cost("the C library, empty cache", done.seconds, "s", 10.0, done.processor)


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


def memory(folder: Path) -> list[Cost]:
    """Return the peak memory [MB] of processes."""
    _say("memory")
    command = ["-m", "scenarios.cli.start", "run", "ellipse", "--duration", "2", "--out",
               str(folder / "run")]
    costs = [Cost("hierarchy run ellipse --duration 2", _run(command).memory, "MB", 300.0)]
    after = json.loads(_run(["-c", _WORKER]).said.splitlines()[-1])
    return [*costs, Cost("a worker of a sweep of 20 runs", max(after), "MB", 300.0),
            Cost("growth over the last 15 runs", after[-1] - after[4], "MB")]


def resident_after(job: Any) -> float:
    """Return the most memory [MB] that this process has had after a run of a sweep."""
    from scenarios.results.run import outcome

    outcome(job)
    return resident() / 1024.0


class _Done(NamedTuple):
    """Output of a process, wall and processor seconds, peak memory [MB]."""

    said: str
    seconds: float
    processor: float
    memory: float


def _run(arguments: list[str], **environment: str) -> _Done:
    """Run Python with arguments; raises RuntimeError with its output if it fails.

    It keeps bytecode, as Python does unless it is told otherwise: without, it compiles each module
    that it imports, which takes longer than all else.
    """
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    kept["PYTHONPATH"] = os.pathsep.join(
        filter(None, [str(_ROOT), kept.get("PYTHONPATH")]))
    with tempfile.TemporaryDirectory() as temporary:
        measured = Path(temporary) / "measured.json"
        done = subprocess.run([sys.executable, "-S", "-c", _LAUNCH, str(measured), sys.executable,
                               *arguments], capture_output=True, text=True, check=False,
                              env={**kept, **environment})
        if done.returncode != 0:
            raise RuntimeError(f"{arguments}: {done.stderr.strip()}")
        seconds, processor, memory = json.loads(measured.read_text())
    return _Done(done.stdout, seconds, processor, memory / _MB)


def _say(what: str) -> None:
    print(f"{what} ...", file=sys.stderr, flush=True)
