"""`hierarchy help`: what a key of a scenario file means, or how a command is used."""

from __future__ import annotations

import typer

from hierarchy.errors import UnknownNameError
from scenarios.cli.terminal import print_list
from scenarios.config import Scenario
from scenarios.config.reference import explained, keys_of, places_of, sections


def print_help(context: typer.Context, what: str | None) -> None:
    """Print what a key means, else how the command of that name is used, else where the key is."""
    above = context.parent
    assert above is not None, "help is a command of the application"
    commands = getattr(above.command, "commands", {})
    if what is None:
        print_list("commands, see `hierarchy help COMMAND`",
                   {name: one.get_short_help_str(60) for name, one in commands.items()})
        print_list("keys of a scenario file, see `hierarchy help KEY`",
                   {key.name: key.meaning for key in keys_of(Scenario)})
    elif lines := explained(what):
        print(*lines, sep="\n")
    elif what in commands:
        print(commands[what].get_help(typer.Context(commands[what], above, what)))
    elif places := places_of(what):
        print(f"{what} is a key of several sections:", *places, sep="\n  ")
    else:
        known = {f"{place.strip('[]')}.{key.name}".lstrip(".")
                 for place, section in sections() for key in keys_of(section)}
        raise UnknownNameError("key or command", what, {*known, *commands})
