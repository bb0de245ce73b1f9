"""The application, the options that commands share, and the names that the shell completes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from scenarios.config import Scenario

app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False)
INTERRUPTED = 130  # exit code of a command that Ctrl-C ended
PORT = 8080
_LIBRARY = Path(__file__).parents[1] / "library"
_LONG = 50  # characters of a change in a title


def names_of(*kinds: str) -> Callable[[str], list[str]]:
    """Return what completes names of "scenarios", "groups" or "sweeps"; the shell adds files."""
    def complete(incomplete: str) -> list[str]:
        from scenarios.files import scenarios_in

        return [name for kind in kinds for name in (
            scenarios_in(_LIBRARY) if kind == "scenarios" else
            sorted(path.stem for path in (_LIBRARY / kind).glob("*.toml")))
                if name.startswith(incomplete)]

    return complete


def complete_resolvers(incomplete: str) -> list[str]:
    """Return the completions of the last entry of a list "tpm,hcod,..."."""
    import solvers

    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in (*solvers.names(), *solvers.variants())
            if name.startswith(last)]


def _given(path: str | Path) -> Path:
    """Return a path or a default, ~ as the home folder, which a shell leaves behind `--out=`."""
    from hierarchy.errors import HierarchyError, file_path

    if not str(path).strip():  # as an unset variable of a shell leaves it
        raise typer.BadParameter("the path is empty")
    try:
        return file_path("path", path)
    except HierarchyError as error:
        raise typer.BadParameter(str(error)) from error


def output(help: str, metavar: str = "FOLDER") -> Any:
    """Return the option `--out`."""
    return typer.Option("--out", metavar=metavar, help=help, parser=_given)


def refuse_given(context: typer.Context, why: str, *names: str) -> None:
    """Raise BadParameter if the command line has options that would have no effect, and say why."""
    if given := ["/".join((*one.opts, *one.secondary_opts)) for one in context.command.params
                 if one.name in names
                 and "COMMANDLINE" in str(context.get_parameter_source(one.name))]:
        raise typer.BadParameter(why, param_hint=", ".join(given))


def _part(text: str) -> tuple[int, int]:
    i, slash, count = text.partition("/")
    if not (slash and i.isdecimal() and count.isdecimal()):
        raise typer.BadParameter(f"expected I/N such as 1/8, got {text!r}")
    return int(i), int(count)


def _allow(modules: list[str] | None) -> list[str] | None:
    """Import the plugins that the user names."""
    from hierarchy import plugins

    for module in modules or ():
        plugins.allow(module)
    return modules


Plugins = Annotated[list[str] | None, typer.Option(
    "--plugin", metavar="MODULE", callback=_allow, is_eager=True,
    help="Import a module of your own that defines tasks, resolvers, robots, plants or sensors. "
         "May be repeated.")]
Changes = Annotated[list[str] | None, typer.Option(
    "--set", metavar="KEY=VALUE",
    help="Change a scenario value: dotted key and TOML value. May be repeated.")]
Duration = Annotated[float | None, typer.Option(
    "--duration", metavar="SECONDS", help="Duration of the run. Default: that of the scenario.")]
Out = Annotated[Path | None, output("Output folder, new or empty. Default: a new folder in runs/.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Workers = Annotated[int | None, typer.Option(
    "--workers", metavar="N", min=1,
    help="Processes on this machine. Default: one per processor.")]
Scheduler = Annotated[str | None, typer.Option(
    "--scheduler", metavar="ADDRESS", help="Use the workers of this Dask scheduler instead; needs "
    "the extra `sweep`.")]
Part = Annotated[Any, typer.Option(
    "--part", metavar="I/N", parser=_part,
    help="Make only the I-th of N parts of the runs, for job arrays; the same command without it "
         "then merges all parts.")]
Port = Annotated[int, typer.Option("--port", metavar="N", min=0, max=65535,
                                   help="Port of the page on 127.0.0.1; 0 for any free port.")]
Browser = Annotated[bool, typer.Option("--browser/--no-browser",
                                       help="Open a browser, or only print the address.")]
Run = Annotated[Path, typer.Argument(metavar="RUN", parser=_given,
                                     help="Run folder of `hierarchy run`.")]
Runs = Annotated[list[Path], typer.Argument(
    metavar="RUN...", parser=_given, help="Folders of `hierarchy run` or `compare`.")]


def listed_in(specs: str) -> list[str]:
    """Return the names in "tpm,hcod,..."."""
    named = [spec.strip() for spec in specs.split(",")]
    if not all(named):
        raise typer.BadParameter(f"an empty name in {specs!r}", param_hint="--resolvers")
    return named


def loaded(name: str, changes: list[str] | None, duration: float | None = None) -> Scenario:
    """Load a scenario with changes, which then stand in its title."""
    from scenarios.config import load

    lengthened = [] if duration is None else [f"control.duration={duration!r}"]
    found = load(name, [*(changes or []), *lengthened])
    if not changes:
        return found
    said = ", ".join(one if len(one) < _LONG else f"{one[:_LONG]}..." for one in changes)
    return found.model_copy(update={"title": f"{found.title or found.name} ({said})"})
