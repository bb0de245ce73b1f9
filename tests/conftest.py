"""What all tests share: one thread of linear algebra, figures without a screen, Ctrl-C."""

import os
import signal

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads wait for each other
os.environ.setdefault("MPLBACKEND", "Agg")


@pytest.fixture(scope="session", autouse=True)
def _interruptible():
    """Programs started by a test can be interrupted, also where a shell's job ignores SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.fixture
def _without_figures(monkeypatch):
    """Runs are saved without their figures, which take most of the time of a short run."""
    monkeypatch.setattr("scenarios.draw.figures.letter.write_all", lambda recording, folder: None)
