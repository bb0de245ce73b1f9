"""Compile kernels ahead: `python -m scenarios.ahead` writes the object files of the package.

With each it writes LLVM code, from which other processors make their object files and `hierarchy
library` the C library. With the name of a part it writes that one; `solvers` needs nothing but
numba and scipy.

`calls.txt` says what Python calls. `python -m scenarios.ahead record` writes it anew, of what JOBS
call: each kind of call of the documents, once.
"""

import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from io import StringIO
from pathlib import Path
from time import monotonic
from typing import Any

import numpy as np

from scenarios.results.pool import ended

CALLS = Path(__file__).with_name("calls.txt")
_OTHERS = CALLS.with_name("others.toml")
# The first part of a name of a kernel decides which object file it is in.
PARTS = {"solvers": ("solvers",), "robots": ("hierarchy", "scenarios")}
# Together they have every kind of task, sensor and plant of the shipped scenarios.
_SCENARIOS = ("crawl", "dual-arm", "ellipse", "ellipse-3d", "ellipse-danger-bounds", "ellipse-hqp",
              "ellipse-inertia", "ellipse-mass", "ellipse-nullspace", "ellipse-published",
              "ellipse-set-based", "human", "humanoid", "reach-torque", "wipe")
_KUKA = [0.9, -0.9, 0.9, 1.2, 1.0, 1.0, 0.3]  # a configuration [rad]


def main() -> None:
    """Write the object files of the parts that are named, or all, unless they are current."""
    from hierarchy.jit.caching import FOLDER
    from hierarchy.jit.exporting import ENVIRONMENT

    names = sys.argv[1:]
    if names == ["record"]:
        CALLS.write_text("".join(f"{call}\n" for call in _recorded()))
        names = []
    begun, calls = monotonic(), CALLS.read_text().splitlines()
    parts = [(FOLDER / f"{part}.o", [call for call in calls if call.startswith(PARTS[part])])
             for part in names or PARTS if not is_current(part)]
    for file, entries in parts:
        _say(f"{file.name}: compiling {len(entries)} entries of kernels, once ...")
    os.environ.update(ENVIRONMENT)  # of the processes that compile
    for (file, _), size in ended(compile_part, parts):
        _say(f"{file.name}: {size / 1e6:.2f} MB after {monotonic() - begun:.0f} s")


def is_current(part: str) -> bool:
    """Whether the object file of a part was made of the calls and sources as they are."""
    from hierarchy.jit import exporting
    from hierarchy.jit.caching import FOLDER

    file, functions = FOLDER / f"{part}.o", _functions(part)
    return (exporting.is_current(file, _listed())
            and exporting.stored(file.with_suffix(".bc"), functions) is not None)


def record(job: str) -> list[str]:
    """Return the calls of kernels that a job makes, and those of this process before it."""
    from hierarchy.jit.compiling import asked

    with (redirect_stdout(StringIO()), redirect_stderr(StringIO()),
          tempfile.TemporaryDirectory() as folder):
        JOBS[job](Path(folder))
    return sorted(asked)


def compile_part(part: tuple[Path, Sequence[str]]) -> int:
    """Write one object file and return its size [B]."""
    from hierarchy.jit.exporting import build

    file, calls = part
    build(file, _listed(), calls, lambda count: None if count % 20 else _say(
        f"{file.stem}: {count} of {len(calls)}"), _functions(file.stem))
    return file.stat().st_size


def _recorded() -> list[str]:
    """Return all calls of all jobs in one order."""
    calls = set[str]()
    for job, found in ended(record, list(JOBS)):
        if found is None:
            raise SystemExit(f"task-hierarchy: the job {job} ended its process")
        calls.update(found)
    return sorted(calls)


def _functions(part: str) -> dict[str, Any]:
    """Return the functions of C that are compiled with a part."""
    from solvers.library.entries import FUNCTIONS

    return FUNCTIONS if part == "solvers" else {}


def _listed() -> str:
    from hierarchy.jit.sources import digest_of

    return digest_of(str(CALLS))


def _say(what: str) -> None:
    print(f"task-hierarchy: {what}", file=sys.stderr, flush=True)


def _run(scenario: str, folder: Path, *options: str) -> None:
    """Make a run of a few ticks."""
    from scenarios.cli.main import run_command

    if run_command(["run", scenario, *options, "--duration", "0.01", "--out", str(folder)]) > 1:
        raise SystemExit(f"hierarchy run {scenario} failed")


def _arrays(_: Path) -> None:
    """Solve hierarchies of plain arrays with every resolver, once and again from memory."""
    from solvers import certify, explain, make, names

    for h, handled in _hierarchies():
        for name in names():
            for damping in (0.0, 0.05):
                resolver: Any = make(name, damping=damping)
                if resolver.handles in handled:
                    result = resolver.solve(h)
                    resolver.solve(h, memory=result.memory)
        result = make("hcod").solve(h)
        explain(h, result)
        certify(h, result.x)
        result.verified(h)
        for name in ("hcod", "hqp"):
            make(name).solve(h.changed(give=np.append(np.ones(h.m - 1), 0.0)))


def _hierarchies() -> Iterator[tuple[Any, tuple[str, ...]]]:
    """Yield hierarchies, each with what a resolver must be able to handle."""
    from hierarchy import Hierarchy

    yield Hierarchy.from_levels([(np.eye(3)[:1], [1.0]), (np.eye(3)[1:], [1.0, 2.0])]), (
        "equalities", "bounds", "inequalities", "activations")
    yield Hierarchy.from_levels([([[1, 0], [0, 1]], [-0.1] * 2, [0.1] * 2), ([[1.0, 0.5]], [0.3])]
                                ), ("bounds", "inequalities")
    r = np.random.default_rng(0)
    for _ in range(20):  # some need the second ways of a resolver
        A, b = r.normal(size=(3, 3, 6)), r.normal(size=(3, 3))
        A[1, 2] = 2.0 * A[1, 0]
        yield Hierarchy.from_levels([(A[0], b[0] - 1.0, b[0]), (A[1], b[1]),
                                     (A[2], b[2] - 0.1, b[2])]), ("inequalities",)


def _robot(_: Path) -> None:
    """Move a robot of seven joints within its limits, in one call."""
    from hierarchy import Robot
    from hierarchy.paths import Still
    from hierarchy.tasks import Orientation, Position, Posture
    from solvers import solve_ik

    robot = Robot.load("kuka_lwr")
    frame = robot.frame("end_effector")
    tasks = [Position(frame, Still([0.3, 0.5, 0.1])), Orientation(frame, np.eye(3)),
             Posture((0.5,) * 7)]
    solve_ik(robot, _KUKA, tasks, limits=True, dt=0.01)


def _others(folder: Path) -> None:
    """Run the tasks of no shipped scenario, at both levels."""
    for level in ("velocity", "acceleration"):
        _run(str(_OTHERS), folder / level, "--set", f"control.level={level}")


def _tasks_of_pink(_: Path) -> None:
    """Resolve tasks of another package, with its limits and its damping."""
    import pink
    from pink.tasks import FrameTask, PostureTask

    from hierarchy import Robot
    from solvers.adapters.for_pink import solve_ik

    robot = Robot.load("kuka_lwr")
    now = pink.Configuration(robot.model, robot.model.createData(), np.array(_KUKA))
    tasks: list[Any] = [FrameTask("end_effector", 1.0, 0.5), PostureTask(cost=1.0)]
    for task in tasks:
        task.set_target_from_configuration(now)
    for damping in (0.0, 0.1):
        solve_ik(now, tasks, 0.01, damping=damping)


def _batches(_: Path) -> None:
    """Solve many hierarchies in one call."""
    from solvers import make
    from solvers.batch import Batch, solve

    r: Any = np.random.default_rng(0)
    A, b = r.normal(size=(3, 5, 7)), r.normal(size=(3, 5))
    for name in ("tpm", "hcod"):
        solve(Batch(A, b, b, sizes=np.array([3, 1, 1])), make(name))


def _kept_factorised(_: Path) -> None:
    """Change a stack that is kept factorised."""
    from solvers.factorization import Factorization

    r = np.random.default_rng(0)
    hand, elbow, gaze = (r.normal(size=(m, 30)) for m in (3, 2, 2))
    stack = Factorization([hand, elbow, gaze], names=["hand", "elbow", "gaze"])
    stack.solve({"hand": [0.1, -0.2, 0.3], "elbow": [0.0, 0.1], "gaze": [0.2, 0.0]})
    stack.swap("hand", "gaze")
    stack.insert("limit", np.eye(30)[:1], at=0)
    stack.delete("elbow")
    stack.solve({"gaze": [0.2, 0.0], "limit": [0.0], "hand": [0.1, -0.2, 0.3]},
                reference=np.ones(30))


JOBS: dict[str, Callable[[Path], None]] = {
    **{name: partial(_run, name) for name in _SCENARIOS},
    "others": _others, "arrays": _arrays, "robot": _robot, "pink": _tasks_of_pink,
    "batches": _batches, "kept": _kept_factorised}
