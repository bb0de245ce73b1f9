"""Compiled kernels are cached by all that they are made of."""

import importlib
import os
import subprocess
import sys

import numba
import pytest

from hierarchy.jit import caching

HELPER = """
from hierarchy.jit import compiled

@compiled
def twice(x):
    return 2.0 * x
"""
KERNEL = """
from helper_of_test_jit import twice
from numbers_of_test_jit import SHARE
from hierarchy.jit import compiled

@compiled
def outer(x):
    return further_down(x)

@compiled
def further_down(x):
    return SHARE * twice(x)
"""


def kernel(folder, share):
    """The kernel `outer` of modules in a folder, imported anew."""
    (folder / "numbers_of_test_jit.py").write_text(f"SHARE = {share}\n")
    (folder / "helper_of_test_jit.py").write_text(HELPER)
    (folder / "kernel_of_test_jit.py").write_text(KERNEL)
    for name in ("numbers_of_test_jit", "helper_of_test_jit", "kernel_of_test_jit"):
        sys.modules.pop(name, None)
    importlib.invalidate_caches()
    return importlib.import_module("kernel_of_test_jit").outer


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder of modules, with a cache of its own."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    caching.cache_folder.cache_clear()
    yield tmp_path
    caching.cache_folder.cache_clear()


@pytest.mark.parametrize("damage", [lambda kept: kept[:50], lambda kept: b"",
                                    lambda kept: kept[:-1] + bytes([kept[-1] ^ 1])])
def test_a_damaged_cache_is_compiled_again(folder, damage):
    assert kernel(folder, 0.5)(4.0) == 4.0
    (kept,) = (folder / "cache").rglob("kernel_of*outer*")
    whole = kept.read_bytes()
    kept.write_bytes(damage(whole))
    assert kernel(folder, 0.5)(4.0) == 4.0
    assert kept.read_bytes() != damage(whole)


def test_a_kernel_knows_what_helpers_below_it_use(folder):
    half, whole = kernel(folder, 0.5), kernel(folder, 1.25)
    if hasattr(half, "constants"):  # plain functions under NUMBA_DISABLE_JIT
        assert "SHARE = 0.5" in half.constants
        assert "SHARE = 1.25" in whole.constants
        assert all(name.partition(" ")[0].isupper() for name in half.constants)
        assert str(folder / "helper_of_test_jit.py") in half.source_files
    assert (half(4.0), whole(4.0)) == (4.0, 10.0)


KEPT = """
import sys
sys.path.insert(0, sys.argv[1])
from kept_of_test_jit import Two, halves, hashed, last, squares
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


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is compiled")
def test_a_kept_kernel_loads_without_what_compiling_needs_and_others_compile_after_it(tmp_path):
    (tmp_path / "kept_of_test_jit.py").write_text(KEPT_KERNELS)
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
