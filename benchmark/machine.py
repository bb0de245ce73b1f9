"""The machine of a benchmark, and pinning to one core."""

from __future__ import annotations

import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path

_PACKAGES = ("numpy", "numba", "scipy", "qpsolvers", "proxsuite", "osqp", "quadprog", "daqp",
             "piqp", "clarabel")


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
    about = Path("/proc/cpuinfo")
    lines = about.read_text().splitlines() if about.is_file() else []
    named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    known = {one.metadata["Name"]: one.version for one in metadata.distributions()}
    return {"processor": named[0] if named else platform.processor() or "unknown",
            "cores": str(os.cpu_count()), "system": f"{platform.system()} {platform.machine()}",
            "python": platform.python_version(),
            **{name: known.get(name, "not installed") for name in _PACKAGES}}
