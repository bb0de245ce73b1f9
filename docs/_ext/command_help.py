"""What `hierarchy COMMAND --help` prints, for every command and those below it.

A page that has the line `<!-- help of every command -->` gets it there.
"""

import os

MARK = "<!-- help of every command -->"


def setup(app):
    """Fill in the mark before the page is parsed."""
    app.connect("source-read", _fill)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}


def _fill(app, docname, source):
    if MARK in source[0]:
        source[0] = source[0].replace(MARK, "\n".join(_sections()))


def _sections():
    os.environ["COLUMNS"] = "90"
    import typer

    from scenarios.cli.main import app

    yield from _helps("", typer.main.get_command(app).commands)


def _helps(above, commands):
    for name, command in commands.items():
        whole = f"{above}{name}"
        context = command.make_context(f"hierarchy {whole}", [], resilient_parsing=True)
        yield f"## {whole}\n\n```text\n{command.get_help(context)}\n```\n"
        yield from _helps(f"{whole} ", getattr(command, "commands", {}))
