"""The cache of kernels is a convenience: whatever becomes of it, every number is right."""

import os
import subprocess
import sys

import numba
import pytest

NUMBERS, HELPER = "ONE = 1.0\n", """
from hierarchy.jit import compiled
from numbers_here import ONE
@compiled
def f(x):
    return x + ONE
"""
USER = """
from hierarchy.jit import compiled
from helper import f
@compiled
def g(x):
    return f(x)
"""
SOLVE = "from user import g; print(g(10.0), sum(g._cache_misses.values()))"
pytestmark = [
    pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled"),
    pytest.mark.skipif(sys.platform == "win32", reason="owners and modes of files"),
    pytest.mark.slow]


@pytest.fixture
def ask(tmp_path):
    """Runs a kernel in a new process with settings; returns what it prints on both streams."""
    (tmp_path / "numbers_here.py").write_text(NUMBERS)
    (tmp_path / "helper.py").write_text(HELPER)
    (tmp_path / "user.py").write_text(USER)

    def asked(code=SOLVE, **settings):
        kept = {name: value for name, value in os.environ.items()
                if name not in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, text=True, check=True,
                              capture_output=True, env={**kept, **settings})
        return done.stdout.split(), done.stderr

    return asked


@pytest.fixture
def cache(ask, tmp_path):
    """The folder of a cache that has the kernels."""
    ask(XDG_CACHE_HOME=str(tmp_path / "cache"))
    return tmp_path / "cache"


def files(folder):
    return [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in str(path)]


@pytest.mark.parametrize(("file", "old", "new"), [
    ("helper.py", "x + ONE", "x + 91.0"), ("numbers_here.py", "1.0", "91.0")])
def test_a_changed_helper_or_number_is_noticed(ask, tmp_path, file, old, new):
    folder = str(tmp_path / "cache")
    assert ask(XDG_CACHE_HOME=folder)[0] == ["11.0", "1"]
    (tmp_path / file).write_text((tmp_path / file).read_text().replace(old, new))
    assert ask(XDG_CACHE_HOME=folder)[0] == ["101.0", "1"]


@pytest.mark.parametrize("damage", [lambda kept: kept[:50],
                                    lambda kept: kept[:-1] + bytes([kept[-1] ^ 1])])
def test_a_damaged_cache_is_compiled_again(ask, cache, damage):
    (kept,) = (file for file in files(cache) if file.name.startswith("user.g-"))
    kept.write_bytes(damage(kept.read_bytes()))
    assert ask(XDG_CACHE_HOME=str(cache))[0] == ["11.0", "1"]


def test_a_helper_that_was_compiled_again_is_found_by_its_callers(ask, cache):
    """Its symbol has the number of functions that a process compiled before it."""
    (stored,) = (file for file in files(cache) if file.name.startswith("helper.f-"))
    stored.unlink()
    later = f"import numba; [numba.njit(lambda x: x)(1) for _ in range(9)]; {SOLVE}"
    assert ask(later, XDG_CACHE_HOME=str(cache))[0] == ["11.0", "1"]
    for path in cache.rglob("*"):  # which then cannot be written, and is read
        path.chmod(0o555 if path.is_dir() else 0o444)
    assert ask(XDG_CACHE_HOME=str(cache)) == (["11.0", "0"], "")


@pytest.mark.parametrize("settings", [{"XDG_CACHE_HOME": "here"}, {"HOME": "/proc/nowhere"},
                                      {"XDG_CACHE_HOME": "/dev/null"}], ids=str)
def test_without_a_usable_folder_nothing_is_written_here_and_one_line_says_so(
        ask, tmp_path, settings):
    before = files(tmp_path)
    said, warned = ask(**{"HOME": "/dev/null", **settings})
    assert said == ["11.0", "1"]
    assert warned.count("compiled kernels are not kept") == 1
    assert files(tmp_path) == before


@pytest.mark.parametrize("change", [lambda path: path.chmod(0o666),
                                    lambda path: os.chown(path, 12345, 12345)])
def test_a_file_that_another_user_can_have_written_is_not_loaded(ask, cache, change):
    try:
        for path in files(cache):
            change(path)
    except PermissionError:
        pytest.skip("only root can give files away")
    assert ask(XDG_CACHE_HOME=str(cache))[0] == ["11.0", "1"]


KEPT = """
import sys
sys.path.insert(0, sys.argv[1])
from kept_kernels import Two, halves, hashed, last, squares
from numba import njit
import numpy as np
print(hashed("kept") == hash("kept"), last(Two(np.arange(3.0), np.ones(3))))
print(squares(np.arange(3.0)).tolist())
print(sum(squares._cache_misses.values()), "numba.np.npyimpl" in sys.modules)
print(halves(np.arange(3.0)).tolist())
print("scipy.linalg" in sys.modules)
print(float(njit(lambda x: np.cumsum(x)[-1])(np.arange(3.0))))
"""
KEPT_KERNELS = """
from typing import NamedTuple
from hierarchy.jit import compiled
import numpy as np
class Two(NamedTuple):
    first: np.ndarray
    second: np.ndarray
@compiled
def hashed(text):
    return hash(text) + np.zeros(1, np.int64)[0]
@compiled
def last(two):
    return two.first[1:][-1] + two.second[:2][-1]
@compiled
def squares(x):
    y = np.empty(x.size)
    for i in range(x.size):
        y[i] = x[i] * x[i]
    return y
@compiled
def halves(x):
    return squares(x / 2.0)
"""


def test_a_kept_kernel_loads_without_what_compiling_needs_and_others_compile_after_it(tmp_path):
    (tmp_path / "kept_kernels.py").write_text(KEPT_KERNELS)
    said = []
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", KEPT, tmp_path], text=True, check=True,
                              capture_output=True,
                              env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path / "cache")})
        said.append(done.stdout.splitlines())
        for file in (tmp_path / "cache").rglob("*halves*"):
            file.unlink()
    assert [lines.pop(2) for lines in said] == ["1 True", "0 False"]
    assert said[0] == said[1] == ["True 3.0", "[0.0, 1.0, 4.0]", "[0.0, 0.25, 1.0]", "False", "3.0"]
