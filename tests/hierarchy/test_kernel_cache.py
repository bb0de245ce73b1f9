"""The cache of kernels is a convenience: whatever becomes of it, every number is right."""

import os
import subprocess
import sys

import numba
import pytest

HELPER = """
from hierarchy.jit import compiled
@compiled
def f(x):
    return x + 1.0
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
    (tmp_path / "helper.py").write_text(HELPER)
    (tmp_path / "user.py").write_text(USER)

    def asked(code=SOLVE, **settings):
        kept = {name: value for name, value in os.environ.items()
                if name not in ("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
        done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, text=True, check=True,
                              capture_output=True, env={**kept, **settings})
        return done.stdout.split(), done.stderr

    return asked


def files(folder):
    return [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in str(path)]


def test_a_changed_helper_is_noticed(ask, tmp_path):
    folder = str(tmp_path / "cache")
    assert ask(XDG_CACHE_HOME=folder)[0] == ["11.0", "1"]
    (tmp_path / "helper.py").write_text(HELPER.replace("1.0", "91.0"))
    assert ask(XDG_CACHE_HOME=folder)[0] == ["101.0", "1"]


def test_a_helper_that_was_compiled_again_is_found_by_its_callers(ask, tmp_path):
    """Its symbol has the number of functions that a process compiled before it."""
    cache = tmp_path / "cache"
    ask(XDG_CACHE_HOME=str(cache))
    (stored,) = (file for file in files(cache) if file.name.startswith("helper.f-"))
    stored.unlink()
    later = f"import numba; [numba.njit(lambda x: x)(1) for _ in range(9)]; {SOLVE}"
    assert ask(later, XDG_CACHE_HOME=str(cache))[0] == ["11.0", "1"]
    assert ask(XDG_CACHE_HOME=str(cache))[0] == ["11.0", "0"]


@pytest.mark.parametrize("settings", [{"XDG_CACHE_HOME": "here"}, {"HOME": "/proc/nowhere"},
                                      {"XDG_CACHE_HOME": "/dev/null"}], ids=str)
def test_without_a_usable_folder_nothing_is_written_here_and_one_line_says_so(
        ask, tmp_path, settings):
    before = files(tmp_path)
    said, warned = ask(**{"HOME": "/dev/null", **settings})
    assert said == ["11.0", "1"]
    assert warned.count("compiled kernels are not kept") == 1
    assert files(tmp_path) == before


def test_a_cache_that_cannot_be_written_is_read(ask, tmp_path):
    cache = tmp_path / "cache"
    ask(XDG_CACHE_HOME=str(cache))
    for path in cache.rglob("*"):
        path.chmod(0o555 if path.is_dir() else 0o444)
    assert ask(XDG_CACHE_HOME=str(cache)) == (["11.0", "0"], "")


@pytest.mark.parametrize("change", [lambda path: path.chmod(0o666),
                                    lambda path: os.chown(path, 12345, 12345)])
def test_a_file_that_another_user_can_have_written_is_not_loaded(ask, tmp_path, change):
    cache = tmp_path / "cache"
    ask(XDG_CACHE_HOME=str(cache))
    try:
        for path in files(cache):
            change(path)
    except PermissionError:
        pytest.skip("only root can give files away")
    assert ask(XDG_CACHE_HOME=str(cache))[0] == ["11.0", "1"]
