"""Scenarios for robots, runs of them under resolvers, and reports that compare the runs.

The names below are imported when first used, so that `import scenarios` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scenarios.config import Scenario, load, shipped
    from scenarios.loop.simulation import simulate
    from scenarios.measure.run_folder import load_run, save
    from scenarios.measure.verdict import Comparison
    from scenarios.recording.recording import Recording
    from scenarios.results.comparing import compare

__all__ = ["Comparison", "Recording", "Scenario", "compare", "load", "load_run", "save", "shipped",
           "simulate"]

_HOME = {"Comparison": "measure.verdict", "Recording": "recording.recording",
         "Scenario": "config", "compare": "results.comparing", "load": "config",
         "load_run": "measure.run_folder", "save": "measure.run_folder", "shipped": "config",
         "simulate": "loop.simulation"}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        value = globals()[name] = getattr(import_module(f"scenarios.{_HOME[name]}"), name)
    except ModuleNotFoundError as error:
        from hierarchy.errors import missing

        raise missing(error, "scenarios") from None
    return value


def __dir__() -> list[str]:
    return sorted({*(name for name in globals() if name[:2] == "__"), *__all__})
