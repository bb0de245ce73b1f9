"""The C library, made once by the first worker that needs it."""

import os

import c_library as c
import pytest

from solvers.library import write


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """The folder of a library, made once for all workers."""
    import fcntl

    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root
    folder = root / "c-library"
    with (root / "c-library.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            partial = root / "c-library.partial"
            partial.mkdir(exist_ok=True)
            write(partial, c.NAMES, "native")
            partial.rename(folder)
    return folder


@pytest.fixture(scope="session")
def library(folder):
    return c.Library.of(folder)
