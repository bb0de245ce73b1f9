"""Scenarios x resolvers x sampled parameters: many runs on all cores, stored as a table.

`config` validates a sweep file, `sampling` draws its parameters, `planning` lists the runs and
their keys, `run` makes one of them, `store` keeps the outcomes, `engine` passes runs to Dask,
`results`, `page` and `printing` present the outcome. `whole.sweep` does all of this.

Dask and pyarrow come with the extra `sweep`.
"""

from typing import Any

__all__ = ["Sweep", "load_sweep", "sweep"]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    home = {"Sweep": "config", "load_sweep": "config", "sweep": "whole"}
    if name not in home:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"scenarios.sweep.{home[name]}"), name)
