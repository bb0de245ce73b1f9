"""The commands that only a checkout has: `benchmark/` beside this package, found by its place."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

import typer

import scenarios

_ROOT = Path(scenarios.__file__).parents[1]
_ANY = {"allow_extra_args": True, "ignore_unknown_options": True}


def register(app: typer.Typer) -> None:
    """Add `bench` and `reproduce`; without a checkout they say what they need."""
    if (_ROOT / "benchmark" / "commands.py").is_file():
        if str(_ROOT) not in sys.path:
            sys.path.insert(0, str(_ROOT))  # before another's package of the same name
        commands = import_module("benchmark.commands")
        app.add_typer(commands.bench, name="bench")
        app.command()(commands.reproduce)
        return
    for name, what in (("bench", "Measure speed, accuracy and strictness (in a checkout)."),
                       ("reproduce", "Regenerate the numbers in the documents (in a checkout).")):
        app.command(name, help=what, context_settings=_ANY)(_absent(name))


def _absent(name: str) -> Any:
    def command() -> None:
        from hierarchy.errors import HierarchyError

        raise HierarchyError(f"`hierarchy {name}` is not part of the installed package; it runs "
                             "where a checkout of the project is installed: `pip install -e .`")

    return command
