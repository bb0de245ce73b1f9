"""The command `hierarchy`.

Heavy imports happen only when needed, so that `--help` and completion are fast. With `--json` a
command prints one JSON object on standard output and nothing else there. Exit codes: 0 done, 1 a
run stopped with a reported fault, such as `run` interrupted, 2 the command line or a file is
invalid, 130 Ctrl-C, SIGTERM or SIGHUP.
"""

import sys
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from typing import Annotated

import typer

import scenarios.cli.runs
import scenarios.cli.shown  # both add their commands
from scenarios.cli import options as opt
from scenarios.cli.options import app
from scenarios.cli.problems import problems
from scenarios.cli.terminal import exit_code, first_line, print_json, print_lists, shown

app.add_typer(problems, name="problems")
_ROOT = Path(scenarios.__file__).parents[1]  # of a checkout, if `benchmark/` is beside this package


def run_command(arguments: list[str]) -> int:
    """Run a command line and return its exit code; errors become one line on stderr."""
    try:
        code = app(arguments or ["--help"], prog_name="hierarchy", standalone_mode=False)
        return int(code or 0) if code != opt.INTERRUPTED else interrupted()
    except typer.TyperException as error:
        return exit_code(f"{error.format_message()}{_given(error, arguments)}", wrong=True)
    except (KeyboardInterrupt, typer.Abort):
        return interrupted()
    except Exception as error:
        from hierarchy.errors import HierarchyError

        if isinstance(error, HierarchyError):
            return exit_code(_with_its_file(str(error), arguments), wrong=True)
        if isinstance(error, OSError):
            return exit_code(f"{error.filename}: {error.strerror}" if error.filename else
                             error.strerror or str(error))
        if isinstance(error, RuntimeError) and type(error).__module__.startswith("scenarios."):
            return exit_code(str(error))  # a page that cannot be made, a cluster that is lost
        raise


def _print_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        print(f"hierarchy {version('task-hierarchy')}")
        raise typer.Exit


@app.callback()
def root(version: Annotated[bool, typer.Option(
        "--version", is_eager=True, callback=_print_version,
        help="Print the version and exit.")] = False) -> None:
    """Resolve prioritized robot tasks in many ways, and compare the results."""


@app.command("list")
def list_(plugin: opt.Plugins = None, as_json: opt.AsJson = False) -> None:
    """List scenarios, groups, sweeps, resolvers, tasks and robots."""
    import solvers
    from hierarchy import plugins
    from hierarchy.robot import ROBOTS
    from hierarchy.robots.table import in_words
    from hierarchy.tasks import TASKS
    from scenarios.config import load, shipped, shipped_groups
    from scenarios.config.reading import load_group
    from scenarios.results.plan import load_sweep, shipped_sweeps

    entries = {"scenarios": {name: load(name).title for name in shipped()},
               "groups": {name: load_group(name).title for name in shipped_groups()},
               "sweeps": {name: load_sweep(name).title for name in shipped_sweeps()},
               "resolvers": {name: f"{meant or first_line(one)} Damps {one.damps}."
                             for name, meant in (dict.fromkeys(solvers.names(), "") | {
                                 name: f"The same as {spec}."
                                 for name, spec in solvers.variants().items()}).items()
                             for one in [solvers.make(name)]},
               "tasks": {name: first_line(task) for name, task in TASKS.items()},
               "robots": {name: in_words(table) for name, table in ROBOTS.items()}}
    for group in plugins.GROUPS:
        if own := plugins.own(group):
            entries.setdefault(group, {}).update({
                name: f"{first_line(thing)} (plugin)" for name, thing in own.items()})
    print_lists(entries, as_json)


@app.command()
def library(context: typer.Context,
            out: Annotated[Path, opt.output("Folder of the library: new or empty, or an existing "
                                            "one with --check.")],
            resolvers: Annotated[str, typer.Option(
                "--resolvers", metavar="NAMES", help="Of hcod, tpm, recursive, sns, merged.")
                ] = "hcod,tpm,recursive,sns",
            target: Annotated[str, typer.Option(
                "--target", metavar="TARGET", help="native, x86_64 (any) or aarch64 (any).")
                ] = "native",
            fix: Annotated[tuple[int, int, int] | None, typer.Option(
                "--fix", metavar="N M LEVELS", help="Unknowns, rows and levels of equalities for "
                "which hcod gets faster code; takes some 10 s to compile.")] = None,
            check: Annotated[bool, typer.Option(
                "--check", help="Write nothing: compare the kernels of the library in the folder "
                                "with those installed.")] = False,
            as_json: opt.AsJson = False) -> int:
    """Write the resolvers as a C library.

    The same kernels, without Python.
    """
    from dataclasses import asdict

    from scenarios.files import claim, whole
    from solvers.library import differs, write

    if check:
        opt.refuse_given(context, "cannot be combined with --check", "resolvers", "target", "fix")
        difference = differs(out)
        if as_json:
            print_json({"folder": shown(out), "same": not difference, "difference": difference})
        elif difference:
            return exit_code(f"{shown(out)}: {difference}")
        else:
            print(f"{shown(out)}: same kernels as installed")
        return int(bool(difference))
    folder = claim(out)
    with whole(folder) as partial:
        made = write(partial, opt.listed_in(resolvers), target, fix or ())
    if as_json:
        print_json({"folder": shown(folder), **asdict(made)})
        return 0
    print(f"for {made.machine}; kernels {made.digest}",
          *(shown(folder / name) for name in made.files), sep="\n")
    if made.shared:
        print(f"no shared library: {made.shared}")
    return 0


@app.command()
def check(file: Annotated[str, typer.Argument(help="A scenario or a robot: file or name.",
                                              autocompletion=opt.names_of("scenarios"))],
          changes: opt.Changes = None, plugin: opt.Plugins = None,
          as_json: opt.AsJson = False) -> None:
    """Validate and summarize a scenario or robot file.

    Builds it and, for a scenario, runs the first tick.
    """
    from scenarios.cli.check import checked

    data, said = checked(file, changes)
    print_json(data) if as_json else print(said)


@app.command("help")
def help_(context: typer.Context, what: Annotated[str | None, typer.Argument(
        metavar="KEY", help="A key of a scenario file, such as avoidance.obstacles.path, a kind "
                            "such as look-at, or a command. Default: all sections and "
                            "commands.")] = None,
          plugin: opt.Plugins = None) -> None:
    """Say what a key of a scenario file means."""
    from hierarchy.errors import UnknownNameError
    from scenarios.config import Scenario, reference

    above = context.parent
    assert above is not None, "help is a command of the application"
    commands = getattr(above.command, "commands", {})
    if what is None:
        print_lists({
            "commands, see `hierarchy help COMMAND`":
                {name: one.get_short_help_str(60) for name, one in commands.items()},
            "keys of a scenario file, see `hierarchy help KEY`":
                {key.name: key.meaning for key in reference.keys_of(Scenario)}})
    elif lines := reference.explained(what):
        print(*lines, sep="\n")
    elif what in commands:
        print(commands[what].get_help(typer.Context(commands[what], above, what)))
    elif places := reference.places_of(what):
        print(f"{what} is a key of several sections:", *places, sep="\n  ")
    elif lines := reference.explained_kind(what):
        print(*lines, sep="\n")
    else:
        raise UnknownNameError("key or command", what, {*reference.places_of(), *commands})


@app.command()
def doctor(as_json: opt.AsJson = False) -> int:
    """Check the installation and run a self-test."""
    from scenarios.cli.doctor import doctor_command

    return doctor_command(as_json)


def _given(error: typer.TyperException, arguments: list[str]) -> str:
    """Return the value of the option at fault, which the message leaves out."""
    options = getattr(getattr(error, "param", None), "opts", ())
    given = [value for option, value in pairwise(arguments) if option in options]
    return f", got {given[-1]!r}" if given and repr(given[-1]) not in error.format_message() else ""


def _with_its_file(text: str, arguments: list[str]) -> str:
    """Prefix an error with the file of the command, unless it names it."""
    files = [one for one in arguments if one.endswith(".toml") or ".toml:" in one]
    return f"{files[0]}: {text}" if len(files) == 1 and files[0] not in text else text


def interrupted() -> int:
    """Say that the command was interrupted, and return its exit code."""
    print("hierarchy: interrupted", file=sys.stderr)
    return opt.INTERRUPTED


def _add_benchmarks() -> None:
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
        app.command(name, help=what, context_settings={
            "allow_extra_args": True, "ignore_unknown_options": True})(_absent)


def _absent(context: typer.Context) -> None:
    from hierarchy.errors import HierarchyError

    raise HierarchyError(f"`hierarchy {context.info_name}` is not part of the installed package; "
                         "it runs where a checkout of the project is installed: `pip install -e .`")


_add_benchmarks()
