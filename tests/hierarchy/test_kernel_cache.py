"""The cache of kernels is a convenience: whatever becomes of it, every number is right."""

import os
import shutil
import subprocess
import sys
from types import FunctionType, SimpleNamespace

import numba
import numpy as np
import pytest
from refusals import refused

from hierarchy.jit import compiled, compiling, saying
from hierarchy.jit.sources import source_digest
from hierarchy.kinematics import rotation_of
from hierarchy.measured import measured
from hierarchy.tasks.pose import _write_jacobian
from solvers.kernels.active_set.exact import solve_hierarchy
from solvers.kernels.active_set.working_set import meet
from solvers.kernels.linalg.rows import swap

MODULES = {"numbers_here.py": "ONE = 1.0\n", "helper.py": """
from hierarchy.jit import compiled
from numbers_here import ONE
@compiled
def f(x):
    return x + ONE
""", "user.py": """
from hierarchy.jit import compiled
from helper import f
@compiled
def g(x):
    return f(x)
"""}
SOLVE = "from user import g; print(g(10.0), sum(g._cache_misses.values()))"
pytestmark = [
    pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled"),
    pytest.mark.skipif(sys.platform == "win32", reason="owners and modes of files")]


def asked(folder, code=SOLVE, **settings):
    """Run a kernel of a folder in a new process; return what it prints on both streams."""
    kept = {name: value for name, value in os.environ.items()
            if name not in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, text=True, check=True,
                          capture_output=True, env={**kept, **settings})
    return done.stdout.split(), done.stderr


weights = np.array([1.0, 2.0])


@compiled
def weighted(x):
    return weights[0] * x


def scaled(by):
    @measured
    def row(kinematics, reads, goal, J, motion):
        J[0, 0] = by

    return row


def test_the_digest_of_a_kernel_is_that_of_its_files_and_of_the_numbers_and_arrays_it_names(
        monkeypatch):
    """Measures that one function made had the code of the first; a bundle names files relatively.
    """
    first, second, again = map(source_digest, map(scaled, (1.0, 2.0, 1.0)))
    assert first == again != second
    before = source_digest(weighted)
    monkeypatch.setitem(globals(), "weights", np.array([1.0, 3.0]))
    assert source_digest(weighted) != before
    function = solve_hierarchy.py_func
    bundled = FunctionType(function.__code__.replace(co_filename="exact.py"), function.__globals__)
    assert source_digest(bundled) == source_digest(solve_hierarchy) != ""

@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with the kernels, and with a cache of them."""
    folder = tmp_path_factory.mktemp("kernels")
    for name, text in MODULES.items():
        (folder / name).write_text(text)
    assert asked(folder, XDG_CACHE_HOME=str(folder / "cache"))[0] == ["11.0", "1"]
    return folder


@pytest.fixture
def ask(made, tmp_path):
    """Runs a kernel as `asked`, in a copy of the folder and its cache of the test's own."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return lambda code=SOLVE, **settings: asked(
        tmp_path, code, **{"XDG_CACHE_HOME": str(tmp_path / "cache"), **settings})


@pytest.mark.parametrize("named", ["helper.ONE", "helper.os.ONE", "helper.near(0.0)"])
def test_a_change_of_what_a_kernel_names_in_a_module_is_noticed(ask, tmp_path, named):
    """It had the number of the run before."""
    (tmp_path / "user.py").write_text(MODULES["user.py"].replace("f(x)", f"x + {named}").replace(
        "from helper import f", "import helper"))
    for one in "1.0", "91.0":
        (tmp_path / "helper.py").write_text(
            f"import os\nimport numba\nONE = os.ONE = {one}\n"
            f"@numba.njit\ndef near(x):\n    return x + {one}\n")
        assert ask()[0] == [str(10.0 + float(one)), "1"]
    assert ask()[0] == ["101.0", "0"]


def files(folder):
    return [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in str(path)]


@pytest.mark.parametrize(("file", "old", "new"), [
    ("helper.py", "x + ONE", "x + 91.0"), ("numbers_here.py", "1.0", "91.0")])
def test_a_changed_helper_or_number_is_noticed(ask, tmp_path, file, old, new):
    (tmp_path / file).write_text((tmp_path / file).read_text().replace(old, new))
    assert ask()[0] == ["101.0", "1"]


def test_a_file_that_changes_while_a_process_runs_is_noticed(ask):
    """A module loaded again had its old code; a later process had that of one begun before."""
    edit = "p = Path(user.__file__); p.write_text(p.read_text().replace('f(x)', 'f(x) + 90.0'))\n"
    begun = f"import user\nfrom importlib import reload\nfrom pathlib import Path\n{edit}"
    assert ask(f"{begun}print(user.g(10.0))")[0] == ["11.0"]
    assert ask(SOLVE)[0] == ["101.0", "1"]
    assert ask(f"{begun}{edit}user.g(10.0); print(reload(user).g(10.0))")[0] == ["281.0"]


@pytest.mark.parametrize("change", [
    lambda path: path.write_bytes(path.read_bytes()[:50]),
    lambda path: path.write_bytes(path.read_bytes()[:-1] + bytes([path.read_bytes()[-1] ^ 1])),
    lambda path: path.chmod(0o666), lambda path: os.chown(path, 12345, 12345)],
    ids=["short", "damaged", "anybody's", "another user's"])
def test_a_file_that_is_damaged_or_that_another_can_have_written_is_compiled_again(
        ask, tmp_path, change):
    (kept,) = (file for file in files(tmp_path / "cache") if file.name.startswith("user.g-"))
    try:
        change(kept)
    except PermissionError:
        pytest.skip("only root can give files away")
    assert ask()[0] == ["11.0", "1"]


def test_a_helper_that_was_compiled_again_is_found_by_its_callers(ask, tmp_path):
    """Its symbol has the number of functions that a process compiled before it."""
    (stored,) = (file for file in files(tmp_path / "cache") if file.name.startswith("helper.f-"))
    stored.unlink()
    later = f"import numba; [numba.njit(lambda x: x)(1) for _ in range(9)]; {SOLVE}"
    assert ask(later)[0] == ["11.0", "1"]
    for path in (tmp_path / "cache").rglob("*"):  # which then cannot be written, and is read
        path.chmod(0o555 if path.is_dir() else 0o444)
    assert ask() == (["11.0", "0"], "")


@pytest.mark.parametrize(("settings", "first", "times"), [
    ({"XDG_CACHE_HOME": "here"}, "", 1), ({"XDG_CACHE_HOME": "", "HOME": "/proc/nowhere"}, "", 1),
    ({"XDG_CACHE_HOME": "/dev/null"}, "", 1),  # then one where nobody hears it: to stdout, once
    *(({"XDG_CACHE_HOME": "/dev/null"}, f"import sys; sys.stderr = {stream}; ", 0)
      for stream in ("None", "sys.stdin"))], ids=str)
def test_without_a_usable_folder_nothing_is_written_here_and_one_line_says_so(
        ask, tmp_path, settings, first, times):
    before = files(tmp_path)
    said, warned = ask(first + SOLVE, **{"HOME": "/dev/null", **settings})
    assert (said, warned.count("compiled kernels are not kept")) == (["11.0", "1"], times)
    assert files(tmp_path) == before
    assert times or not warned


def test_a_kept_kernel_loads_without_what_compiling_needs_and_others_compile_after_it(ask):
    code = f"""import sys
import numpy as np
{SOLVE}
print("numba.np.npyimpl" in sys.modules, "scipy.linalg" in sys.modules)
import numba
print(float(numba.njit(lambda x: np.cumsum(x)[-1])(np.arange(3.0))))
"""
    assert ask(code)[0] == ["11.0", "0", "False", "False", "3.0"]


def test_compiling_is_said_once_and_not_by_a_worker(monkeypatch, capsys):
    listeners = []
    monkeypatch.setattr(saying.event, "register", lambda kind, one: listeners.append(one))
    monkeypatch.delenv("TASK_HIERARCHY_WORKER", raising=False)
    saying.announce_compilation.__wrapped__()
    (one,) = listeners
    monkeypatch.setenv("TASK_HIERARCHY_WORKER", "1")
    saying.announce_compilation.__wrapped__()
    assert listeners == [one]
    for _ in range(2):
        one.on_start(SimpleNamespace(data={"dispatcher": meet}))
    assert capsys.readouterr().err.count("compiling kernels") == 1


def test_python_cannot_call_what_is_compiled_for_other_kernels():
    for kernel in (meet, swap):
        refused(f"{kernel.py_func.__name__} is compiled for other", kernel, error=TypeError)


def test_what_makes_arrays_itself_or_by_what_it_calls_is_known():
    assert (rotation_of.allocates, _write_jacobian.allocates, swap.allocates, meet.allocates) == (
        True, True, False, False)


def test_the_files_of_a_kernel_are_looked_for_once(monkeypatch):
    kinds, found = (numba.float64,), [None, "entry"]
    monkeypatch.setattr(compiling, "find", lambda *_: found.pop(0))
    monkeypatch.setattr(compiling, "asked", set())
    monkeypatch.setattr(solve_hierarchy, "ready", {})
    monkeypatch.setattr(solve_hierarchy, "_insert", lambda *_: None)
    assert [solve_hierarchy._ready(kinds) for _ in range(3)] == [None, "entry", "entry"]
    assert found == []
    assert len(compiling.asked) == 1
