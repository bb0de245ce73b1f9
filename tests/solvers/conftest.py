"""The C library, made once by the first worker that needs it."""

import os

import c_library as c
import pytest

from solvers.library import write


def made(tmp_path_factory, target, resolvers=c.NAMES):
    """The folder of a library, made once for all workers."""
    import fcntl

    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root
    folder = root / f"c-library-{target}"
    with (root / f"{folder.name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            partial = root / f"{folder.name}.partial"
            partial.mkdir(exist_ok=True)
            write(partial, resolvers, target)
            partial.rename(folder)
    return folder


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    return made(tmp_path_factory, "native")


@pytest.fixture(scope="session")
def generic(tmp_path_factory):
    """The library for any x86-64, with one resolver."""
    if os.uname().machine != "x86_64":
        pytest.skip("not an x86-64")
    return made(tmp_path_factory, "x86_64", ("hcod",))


@pytest.fixture(scope="session")
def arm(tmp_path_factory):
    """The library for aarch64, with one resolver."""
    return made(tmp_path_factory, "aarch64", ("hcod",))


@pytest.fixture(scope="session")
def library(folder):
    return c.Library.of(folder)


