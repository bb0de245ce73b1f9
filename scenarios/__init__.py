"""What is asked of which robot, how the ways of resolving it do, and the report about it.

The names below are imported when first used, so that `import scenarios` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from scenarios.compare import Comparison, compare
    from scenarios.config import Scenario, load, shipped
    from scenarios.recording import Recording, load_run, save
    from scenarios.simulate import simulate

__all__ = ["Comparison", "Recording", "Scenario", "compare", "load", "load_run", "save", "shipped",
           "simulate"]

_HOME = {"Comparison": "compare", "Recording": "recording", "Scenario": "config", "load": "config",
         "load_run": "recording", "save": "recording", "shipped": "config"}


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    # `compare` and `simulate` are also the names of their modules: keep the function.
    value = globals()[name] = getattr(import_module(f"scenarios.{_HOME.get(name, name)}"), name)
    return value
