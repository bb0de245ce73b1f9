"""What all tests share: one thread of linear algebra, figures without a screen, Ctrl-C."""

import gc
import os
import shlex
import signal
from importlib.metadata import distributions
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads wait for each other
os.environ.setdefault("MPLBACKEND", "Agg")

# How fast a machine generates examples, or compiles kernels meanwhile, says nothing of the product.
settings.register_profile("any machine", deadline=None,
                          suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

SLOW = frozenset(Path(__file__).with_name("slow.txt").read_text().splitlines())


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Mark the tests of a second or more, as `pytest --durations=0` finds them."""
    for item in items:
        if not SLOW.isdisjoint((item.nodeid, item.nodeid.partition("[")[0])):
            item.add_marker("slow")


def pytest_collection_finish():
    """Spare the garbage collector the modules and the thousands of tests, which stay."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def _interruptible():
    """Programs started by a test can be interrupted, also where a shell's job ignores SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def no_plugins():
    """No plugin is known at the beginning of a test; what it loads is forgotten after it."""
    from unplugged import unplugged

    with unplugged():
        yield


@pytest.fixture
def undrawn(monkeypatch):
    """Figures of pages are made and not drawn, which takes longer than most runs."""
    for module in ("page", "sections", "sampled_page"):
        monkeypatch.setattr(f"scenarios.results.{module}.svg", lambda fig, title: title)


@pytest.fixture
def with_mujoco(tmp_path, monkeypatch):
    """MuJoCo is there, and logs runs that diverge into a folder of the test's own."""
    pytest.importorskip("mujoco")
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def command(capsys):
    """Runs a command line, and further words, that is to end with a code; what it said."""
    from scenarios.cli.main import run_command

    def ended(line, *words, code=0):
        assert run_command([*shlex.split(line), *map(str, words)]) == code
        return capsys.readouterr()

    return ended


@pytest.fixture(scope="session")
def example_robot_data():
    """The package with this name is there, which other packages may bring under another one."""
    if not [*distributions(name="example-robot-data")]:
        pytest.skip("example-robot-data is not installed")


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    """The folder of the C library, made once by the first worker that needs it."""
    import fcntl

    from c_library import NAMES

    from solvers.library import write

    root = tmp_path_factory.getbasetemp()
    root = root.parent if "PYTEST_XDIST_WORKER" in os.environ else root
    folder = root / "c-library"
    with (root / "c-library.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            partial = root / "c-library.partial"
            partial.mkdir(exist_ok=True)
            write(partial, NAMES, "native")
            partial.rename(folder)
    return folder


@pytest.fixture(scope="session")
def library(folder):
    from c_library import Library

    return Library(folder)
