"""The machine of a benchmark, pinning to one core, and work on all of them."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from importlib import metadata
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeVar

from solvers.batch import cores

Found = TypeVar("Found")
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


def on_all_cores(work: Callable[..., Found], calls: Sequence[tuple[Any, ...]]) -> list[Found]:
    """Return work(*call) of each call, in processes side by side: not for what is timed."""
    with ProcessPoolExecutor(min(cores(), len(calls)), get_context("spawn")) as pool:
        return list(pool.map(work, *zip(*calls, strict=True)))


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
