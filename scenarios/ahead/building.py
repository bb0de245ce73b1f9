"""Compile kernels ahead: `python -m scenarios.ahead` writes the machine code of the package.

With it goes LLVM code, from which other processors make their object files and `hierarchy
library` the C library. With the name of a part it writes that one; `solvers` and `others` need
nothing but numba and scipy.

`calls.txt` says what Python calls. `python -m scenarios.ahead record` writes it anew, of what JOBS
call: each kind of call of the documents, once.
"""

import os
import re
import sys
import tempfile
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from io import StringIO
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from hierarchy.jit import exporting
from hierarchy.jit.compiling import asked
from hierarchy.jit.saying import say
from scenarios.results.pool import ended

CALLS = Path(__file__).with_name("calls.txt")
_OTHERS = CALLS.with_name("others.toml")
# The object file of a kernel is the first with the beginning of its name. Those of "others" share
# little with the rest: apart, two cores are busy until all is compiled, the longest first.
PARTS = {
    "others": ("solvers.adapters", "solvers.metric", "solvers.kernels.met.",
               "solvers.kernels.published", "solvers.kernels.reverse", "solvers.kernels.staircase"),
    "robots": ("hierarchy", "scenarios"), "solvers": ("solvers",)}
# Together they have every kind of task, sensor and plant of the shipped scenarios.
_SCENARIOS = ("crawl", "dual-arm", "ellipse", "ellipse-3d", "ellipse-danger-bounds", "ellipse-hqp",
              "ellipse-inertia", "ellipse-mass", "ellipse-nullspace", "ellipse-published",
              "ellipse-set-based", "human", "humanoid", "reach-torque", "wipe")
_DOCUMENTS = Path(__file__).parents[2] / "docs"
_PAGES = ("adapters.md", "batch.md", *(f"theory/{path.name}"  # of resolvers, each with an example
                                       for path in sorted(_DOCUMENTS.glob("theory/*.md"))))
_PYTHON = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)


def main() -> None:
    """Compile the parts that are named, or all, unless they are current."""
    names = sys.argv[1:]
    if names == ["record"]:
        CALLS.write_text("".join(f"{call}\n" for call in _recorded()))
        names = []
    begun = monotonic()
    parts = [part for part in names or list(PARTS)[::-1] if not is_current(part)]
    for part in parts:
        say(f"{part}: compiling {len(_calls(part))} entries of kernels, once ...")
    os.environ.update(exporting.ENVIRONMENT)  # of the processes that compile
    for part, size in ended(compile_part, parts):
        say(f"{part}: {size / 1e6:.2f} MB after {monotonic() - begun:.0f} s")


def is_current(part: str) -> bool:
    """Whether a part was compiled of the calls and sources as they are."""
    return exporting.is_current(part, _calls(part), _functions(part))


def record(job: str) -> list[str]:
    """Return the calls of kernels that a job makes, and those of this process before it."""
    with (redirect_stdout(StringIO()), redirect_stderr(StringIO()),
          tempfile.TemporaryDirectory() as folder):
        JOBS[job](Path(folder))
    return sorted(asked)


def compile_part(part: str) -> int:
    """Compile a part and return the size of its machine code [B]."""
    size: int = exporting.build(part, _calls(part), _functions(part))
    return size


def _recorded() -> list[str]:
    """Return all calls of all jobs in one order."""
    calls = set[str]()
    for job, found in ended(record, list(JOBS)):
        if found is None:
            raise SystemExit(f"task-hierarchy: the job {job} ended its process")
        calls.update(found)
    return sorted(calls)


def _calls(part: str) -> list[str]:
    """Return the calls that are listed for a part."""
    return [call for call in CALLS.read_text().splitlines() if part == next(
        one for one, names in PARTS.items() if call.startswith(names))]


def _functions(part: str) -> dict[str, Any]:
    """Return the functions of C that are compiled with a part."""
    from solvers.library.entries import FUNCTIONS

    return FUNCTIONS if part == "solvers" else {}


def _run(scenario: str, folder: Path, *options: str) -> None:
    """Make a run of a few ticks."""
    from scenarios.cli.main import run_command

    if run_command(["run", scenario, *options, "--duration", "0.01", "--out", str(folder)]) > 1:
        raise SystemExit(f"hierarchy run {scenario} failed")


def _read(page: str, _: Path) -> None:
    """Run the Python code of a page of the documents."""
    blocks = _PYTHON.findall((_DOCUMENTS / page).read_text(encoding="utf-8"))
    exec("\n".join(blocks), {"__name__": "document"})


def _arrays(_: Path) -> None:
    """Solve hierarchies of plain arrays in the ways that no page shows."""
    from hierarchy import Hierarchy
    from hierarchy.measured import drop_faint
    from solvers import make
    from solvers.batch import Batch, solve
    from solvers.resolvers.merged import Merged

    r: Any = np.random.default_rng(0)
    A, b, sizes = r.normal(size=(3, 5, 7)), r.normal(size=(3, 5)), np.array([3, 1, 1])
    solve(Batch(A, b, b, sizes=sizes), make("hcod"))
    h = Hierarchy.from_levels([(np.eye(3)[:1], [1.0]), (np.eye(3)[1:], [1.0, 2.0], [3.0, 3.0])])
    make("hcod", damping=0.05).solve(h).verified(h)
    make("hqp").solve(h.changed(give=np.array([1.0, 1.0, 0.0])))
    Merged().below_one_more(h)  # as of robots in which joints follow others
    drop_faint(np.ones((3, 7))[:, :6], np.zeros(3))  # of a task without a kernel, beside forces


def _others(folder: Path) -> None:
    """Run the tasks of no shipped scenario, at both levels, and measure how far links are apart."""
    from hierarchy import Robot, State
    from hierarchy.avoidance import Barrier
    from hierarchy.tasks import SelfSeparation

    for level in ("velocity", "acceleration"):
        _run(str(_OTHERS), folder / level, "--set", f"control.level={level}")
    robot = Robot.named("kuka_lwr")
    SelfSeparation(robot.capsules, Barrier(0.01)).distances(State.at(robot, robot.rest))


JOBS: dict[str, Callable[[Path], None]] = {
    **{name: partial(_run, name) for name in _SCENARIOS},
    **{page: partial(_read, page) for page in _PAGES}, "others": _others, "arrays": _arrays}
