"""What all tests share: one thread of linear algebra, figures without a screen, Ctrl-C."""

import os
import signal

import pytest
from hypothesis import HealthCheck, settings

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # small matrices: threads wait for each other
os.environ.setdefault("MPLBACKEND", "Agg")

# How fast a machine generates examples, or compiles kernels meanwhile, says nothing of the product.
settings.register_profile("any machine", deadline=None,
                          suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


@pytest.fixture(scope="session", autouse=True)
def _interruptible():
    """Programs started by a test can be interrupted, also where a shell's job ignores SIGINT."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
