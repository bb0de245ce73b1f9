"""The machine of a benchmark, and pinning to one core."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata

from scenarios.measure.run_folder import versions

_PACKAGES = "scipy", "quadprog", "daqp", "piqp", "clarabel"  # besides those of a run


@contextmanager
def one_core() -> Iterator[None]:
    """Pin this process to one of its cores, if the system can, and restore them afterwards."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(before)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def machine() -> dict[str, str]:
    """Return processor, cores and versions by name, without personal data."""
    known = {one.metadata["Name"]: one.version for one in metadata.distributions()}
    return {**versions(), **{name: known.get(name, "not installed") for name in _PACKAGES}}
