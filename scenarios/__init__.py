"""What is asked of which robot, how the ways of resolving it do, and the report about it.

The names below are imported when first used, so that `import scenarios` costs nothing.
"""

import sys
from importlib import import_module
from types import ModuleType
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
    value = globals()[name] = getattr(import_module(f"scenarios.{_HOME.get(name, name)}"), name)
    return value


class _Package(ModuleType):
    """Keeps `scenarios.compare` and `scenarios.simulate` the functions of these names.

    Importing the modules of the same names would otherwise put the modules in their place.
    """

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in __all__ and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
