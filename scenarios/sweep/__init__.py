"""Scenarios x resolvers x sampled parameters: many runs on all cores, kept as a table.

`config` is the validated form of a sweep file, `sampling` draws from it, `planning` makes the runs
and their keys, `run` is one of them, `store` keeps what came of them, `engine` hands them to Dask,
`results` and `page` say what it comes to. `sweep` is the whole.

Dask and pyarrow are the extra `sweep`.
"""

from typing import Any

__all__ = ["Sweep", "load_sweep", "sweep"]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    home = {"Sweep": "config", "load_sweep": "config", "sweep": "whole"}
    if name not in home:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"scenarios.sweep.{home[name]}"), name)
