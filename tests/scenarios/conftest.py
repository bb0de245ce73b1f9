"""Processes that several files of tests let sweeps run on."""

from contextlib import ExitStack

import pytest


@pytest.fixture(scope="session")
def cluster():
    """The address of two processes that stand for a cluster elsewhere: anyone may use its port."""
    from distributed.security import Security

    from scenarios.sweep import engine

    with ExitStack() as stack:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(engine, "_security", Security)
            client = stack.enter_context(engine.connected(workers=2))
        yield client.scheduler.address
