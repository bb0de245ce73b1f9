"""With the object files of kernels, the documented commands compile nothing."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import numba
import pytest

from hierarchy.jit import caching
from hierarchy.jit.caching import Part, parts
from hierarchy.jit.inside import llvm
from scenarios.ahead.building import PARTS, is_current

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")


@pytest.fixture(scope="module", autouse=True)
def _objects():
    if not parts() or not all(map(is_current, PARTS)):
        pytest.skip("the object files are not there, or older than the kernels: make set-up")


def compiled(code, folder, **settings):
    """What a program, in a new process, and all that it starts compile: it is kept in a cache.

    The object files of another processor, made of LLVM code, do not count.
    """
    done = subprocess.run(
        [sys.executable, "-c", code], text=True, capture_output=True, cwd=folder, check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (
            os.environ.get("PYTHONPATH"), str(ROOT)))), "NUMBA_CACHE_DIR": "",
             "XDG_CACHE_HOME": str(folder / "cache"), **settings})
    assert done.returncode == 0, done.stderr
    kept = folder / "cache" / "task-hierarchy"
    return sorted(path.name for path in kept.rglob("*") if path.is_file() and path.suffix != ".o")


[README] = [block for block in re.findall(
    r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL) if "solve_ik" in block]
COMMANDS = ["run ellipse --resolver recursive --set pointing.alpha_d=35 --duration 0.1",
            "run ellipse --duration 0.1", "run human --duration 0.1",
            "run reach-torque --duration 0.01", "library --resolvers recursive",
            "compare ellipse ellipse-velocity --resolvers tpm,recursive,hqp,weighted --workers 1 "
            "--set control.duration=0.02"]
PROGRAMS = {"of the readme": README, "of commands": f"""
from scenarios.cli.main import run_command
for i, command in enumerate({COMMANDS}):
    assert run_command([*command.split(), "--out", str(i)]) < 2
""", "of every kind of task": """
from hierarchy import Stack
from hierarchy.avoidance import Barrier
from hierarchy.tasks import SelfSeparation
from scene import ROBOT, TASKS, state_at, states
apart = SelfSeparation(ROBOT.capsules, Barrier(0.01))
apart.distances(state_at(*states(1)[0]))
for task in [*TASKS.values(), apart]:
    for level in "velocity", "acceleration":
        Stack([task], level).hierarchy(state_at(*states(1)[0]))
""", "beside an array of gigabytes": """
import numpy as np
from hierarchy import Hierarchy, Robot, State
from solvers import make
robot = Robot.load("kuka_lwr")
large = np.empty(3 * 2**27)  # code and its constants came to lie on both sides of it
h = Hierarchy.from_levels([([[1.0, 0.0]], [1.0]), (np.eye(2), [0.0, 2.0])])
for name in ("hcod", "tpm", "reverse"):
    assert np.abs(make(name).solve(h).x - [1.0, 2.0]).max() < 1e-12
assert np.isfinite(State.at(robot, robot.rest).q).all()
"""}


@pytest.mark.parametrize("program", PROGRAMS)
def test_a_program_compiles_nothing(program, tmp_path):
    path = f"{ROOT}:{ROOT / 'tests' / 'helpers'}"
    assert compiled(PROGRAMS[program], tmp_path, PYTHONPATH=path) == []


def test_another_processor_makes_code_once_and_compiles_nothing(tmp_path):
    code = ("import numpy as np\nfrom hierarchy import Hierarchy\nfrom solvers import make\n"
            "box = np.eye(2), [-1.0] * 2, [1.0] * 2\n"
            "x = make('hcod').solve(Hierarchy.from_levels([box, ([[1.0, 2.0]], [4.0])])).x\n"
            "assert np.abs(x - 1.0).max() < 1e-12")
    for _ in range(2):
        assert compiled(code, tmp_path, TASK_HIERARCHY_NATIVE="1", NUMBA_CPU_NAME="generic") == []
        [made] = (tmp_path / "cache" / "task-hierarchy").iterdir()
        assert re.fullmatch(r"solvers-\w+\.o", made.name)


@pytest.mark.parametrize("part", PARTS)
def test_the_llvm_code_has_no_instruction_of_x86(part):
    module = llvm.parse_bitcode(Part.read(part).code("llvm"))
    assert not [one.name for one in module.functions if one.name.startswith("llvm.x86.")]


def test_what_jobs_call_is_listed(tmp_path):
    code = ("from scenarios.ahead.building import CALLS, record\n"
            "found = [record(job) for job in ('arrays', 'others', 'batch.md')]\n"
            "assert 0 < len(found[0]) < len(found[1]) <= len(found[2])\n"
            "assert {*found[-1]} <= {*CALLS.read_text().splitlines()}")
    assert compiled(code, tmp_path) == []


FEW = """
import sys
from pathlib import Path
from hierarchy.jit import caching
from solvers.library import entries
from scenarios.ahead import building
caching.FOLDER, building.CALLS = Path("objects").absolute(), Path("calls.txt")
building.ended = lambda work, jobs: [(job, work(job)) for job in jobs]
entries.FUNCTIONS = {"th_record_size": entries.FUNCTIONS["th_record_size"]}
"""
MAKE = """
building.JOBS = {"arrays": lambda _: None}
building.main()
assert building.is_current("solvers")
"""
ASK = """
from solvers.kernels.merged import record_size
assert record_size(7, 2) > 0
"""


def test_calls_that_are_listed_are_compiled_ahead_for_any_processor(tmp_path, monkeypatch):
    call = "solvers.kernels.merged.record_size(int64, int64)"
    (tmp_path / "calls.txt").write_text(f"{call}\n")
    (tmp_path / "cache" / "task-hierarchy").mkdir(parents=True)
    compiled(f"{FEW}sys.argv[1:] = ['solvers']{MAKE}", tmp_path)
    file = tmp_path / "objects" / "solvers.kernels"
    made, whole = file.stat().st_mtime_ns, file.read_bytes()
    monkeypatch.setattr(caching, "FOLDER", file.parent)
    part = Part.read("solvers")
    assert list(part.entries) == [call]
    for kept, settings in (
            ("index", {}), ("machine", {}), ("llvm", {"TASK_HIERARCHY_NATIVE": "1"})):
        assert compiled(f"{FEW}{ASK}", tmp_path, **settings) == []
        with ZipFile(file) as archive:
            content = archive.read(kept)
        damaged = content[:-1] + bytes([content[-1] ^ 1])  # it crashed, or answered wrongly
        file.write_bytes(whole.replace(content, damaged))
        assert len(compiled(f"{FEW}{ASK}", tmp_path, **settings)) == 1
        shutil.rmtree(tmp_path / "cache")
        file.write_bytes(whole)
    compiled(f"{FEW}sys.argv[1:] = ['record']{MAKE}", tmp_path)
    with pytest.raises(RuntimeError, match="of another build"):
        part.code("machine")
    assert file.stat().st_mtime_ns > made
    assert not (tmp_path / "calls.txt").read_text()


def test_a_call_with_other_types_is_compiled_and_right(tmp_path):
    code = ("import numpy as np\nfrom hierarchy.state import _copy_if_sound\n"
            "q, v, to = np.ones(3, np.float32), np.ones(2), np.zeros(3)\n"
            "assert _copy_if_sound(np.zeros((0, 2), int), q, v, to, np.zeros(2)) == 1\n"
            "assert to.tolist() == [1.0] * 3")
    [name] = compiled(code, tmp_path)
    assert "hierarchy.state._copy_if_sound" in name
