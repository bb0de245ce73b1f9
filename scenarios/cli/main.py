"""The command `hierarchy`.

Heavy imports happen only when needed, so that `--help` and completion are fast. With `--json` a
command prints one JSON object on standard output and nothing else there. Exit codes: 0 done, 1 a
run stopped with a reported fault, 2 the command line or a file is invalid, 130 Ctrl-C,
SIGTERM or SIGHUP.
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli import benchmarks, completion, options
from scenarios.cli.options import (
    INTERRUPTED,
    PORT,
    AsJson,
    Browser,
    Changes,
    Duration,
    Out,
    Part,
    Plugins,
    Port,
    Scheduler,
    Workers,
    output,
)
from scenarios.cli.problems import problems
from scenarios.cli.terminal import first_line, print_json, print_list, shown

if TYPE_CHECKING:
    from scenarios.config import Scenario

_LONG = 50  # characters of a change in a title

app = typer.Typer(rich_markup_mode=None, pretty_exceptions_enable=False)
app.add_typer(problems, name="problems")


def run_command(arguments: list[str]) -> int:
    """Run a command line and return its exit code; errors become one line on stderr."""
    try:
        code = app(arguments or ["--help"], prog_name="hierarchy", standalone_mode=False)
        return int(code or 0) if code != INTERRUPTED else interrupted()
    except typer.TyperException as error:
        return _wrong(f"{error.format_message()}{_given(error, arguments)}")
    except (KeyboardInterrupt, typer.Abort):
        return interrupted()
    except Exception as error:
        from hierarchy.errors import HierarchyError

        if isinstance(error, HierarchyError):
            return _wrong(_with_its_file(str(error), arguments))
        if isinstance(error, OSError):
            return _fault(f"{error.filename}: {error.strerror}" if error.filename else
                          error.strerror or str(error))
        if isinstance(error, RuntimeError) and type(error).__module__.startswith("scenarios."):
            return _fault(str(error))  # a page that cannot be made, a cluster that is lost
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
def list_(plugin: Plugins = None, as_json: AsJson = False) -> None:
    """List scenarios, groups, sweeps, resolvers, tasks and robots."""
    import solvers
    from hierarchy import plugins
    from hierarchy.robot import ROBOTS
    from hierarchy.robots.table import in_words
    from hierarchy.tasks import TASKS
    from scenarios.config import load, shipped, shipped_groups
    from scenarios.config.groups import load_group
    from scenarios.results.sweep_file import load_sweep, shipped_sweeps

    entries = {"scenarios": {name: load(name).title for name in shipped()},
               "groups": {name: load_group(name).title for name in shipped_groups()},
               "sweeps": {name: load_sweep(name).title for name in shipped_sweeps()},
               "resolvers": {name: f"{first_line(one)} Damps {one.damps}."
                             for name in (*solvers.names(), *solvers.variants())
                             for one in [solvers.make(name)]},
               "tasks": {name: first_line(task) for name, task in TASKS.items()},
               "robots": {name: in_words(table) for name, table in ROBOTS.items()}}
    for group in plugins.GROUPS:
        if own := plugins.own(group):
            entries.setdefault(group, {}).update({
                name: f"{first_line(thing)} (plugin)" for name, thing in own.items()})
    if as_json:
        return print_json(entries)
    for what, named in entries.items():
        print_list(what, named)


@app.command()
def run(scenario: Annotated[str, typer.Argument(
            help="Name of a scenario, or a scenario file.", autocompletion=completion.scenarios)],
        resolver: Annotated[str | None, typer.Option(
            "--resolver", metavar="SPEC", autocompletion=completion.resolvers,
            help="Use another resolver: name, or name:setting=value:setting=value.")] = None,
        changes: Changes = None, plugin: Plugins = None, duration: Duration = None,
        out: Out = None, certify: Annotated[bool, typer.Option(
            "--certify", help="Certify the answer of every tick; not part of the measured times.")
            ] = False,
        figures: Annotated[bool, typer.Option(
            "--figures", help="Also draw the run's figures, like `hierarchy figures`.")
            ] = False, as_json: AsJson = False,
        live: Annotated[bool, typer.Option(
            "--live", help="Show the run in the browser and change it interactively; needs the "
                           "extra `view`.")] = False,
        speed: Annotated[float | None, typer.Option(
            "--speed", metavar="X", min=0.01, max=100.0,
            help="With --live: real-time factor. Default: 1.")] = None,
        wait: Annotated[bool, typer.Option(
            "--wait/--no-wait", help="With --live: start when a browser has opened the page, or "
            "at once.")] = True,
        port: Port = PORT, browser: Browser = True) -> int:
    """Run a scenario, measure it, and save the run."""
    if live and (certify or figures or as_json):
        raise typer.BadParameter("cannot be combined with --certify, --figures or --json",
                                 param_hint="--live")
    if speed is not None and not live:
        raise typer.BadParameter("needs --live", param_hint="--speed")
    chosen = _load(scenario, changes, duration)
    if resolver is not None:
        chosen = chosen.with_resolver(resolver)
    from scenarios.files import claim, next_free

    name = f"{chosen.name}-{chosen.control.resolver}"
    folder = claim(out if out is not None else next_free(Path("runs") / name))
    if live:
        from scenarios.cli.view import live_command

        return live_command(chosen, folder, port, speed or 1.0, browser, wait)
    from scenarios.cli.run import run_scenario

    return run_scenario(chosen, folder, certify, figures, as_json)


@app.command()
def compare(scenarios: Annotated[list[str], typer.Argument(
                help="Names of scenarios or groups, or scenario files.",
                autocompletion=completion.compared)],
            resolvers: Annotated[str | None, typer.Option(
                "--resolvers", metavar="SPEC,SPEC,...", autocompletion=completion.resolvers,
                help="Resolvers: name, or name:setting=value; or own, that of each scenario. "
                     "Default: all suitable ones; own for a group.")] = None,
            changes: Changes = None, plugin: Plugins = None, duration: Duration = None,
            out: Out = None, starts: Annotated[int | None, typer.Option(
                "--starts", metavar="N", min=2, help="Compare over N starts sampled from each "
                "scenario's [variation].")] = None,
            seed: Annotated[int, typer.Option(
                "--seed", metavar="S", min=0, help="With --starts: seed of the samples.")] = 0,
            workers: Workers = None, scheduler: Scheduler = None, part: Part = None,
            as_json: AsJson = False) -> int:
    """Run scenarios under several resolvers and report.

    With --starts every resolver gets the same sampled starts, and the report gives statistics; run
    the same command again to resume an interrupted comparison.
    """
    if starts is None and (seed or scheduler or part):
        raise typer.BadParameter("needs --starts", param_hint="--seed, --scheduler, --part")
    from scenarios.config import members, shipped_groups
    from scenarios.config.scenario import OWN

    chosen = [_load(name, changes, duration) for name in members(scenarios)]
    grouped = any(name in shipped_groups() for name in scenarios)
    specs = _split(resolvers) if resolvers is not None else [OWN] if grouped else None
    if starts is not None:
        from scenarios.cli.sweep import starts_command

        return starts_command(chosen, specs, starts, seed, out,
                              options.workers(workers, scheduler, part), as_json)
    from scenarios.cli.compare import compare_scenarios
    from scenarios.files import next_free

    name = scenarios[0] if grouped else chosen[0].name
    folder = out if out is not None else next_free(Path("runs") / f"compare-{name}")
    return compare_scenarios(chosen, specs, folder, as_json, workers)


@app.command()
def sweep(file: Annotated[str, typer.Argument(help="Name of a sweep, or a sweep file.",
                                              autocompletion=completion.sweeps)],
          out: Annotated[Path | None, output(
              "Output folder, new or of a sweep to resume. Default: runs/sweep-NAME.")] = None,
          plugin: Plugins = None, workers: Workers = None, scheduler: Scheduler = None,
          part: Part = None, as_json: AsJson = False) -> int:
    """Run scenarios with sampled parameters.

    Run the same command again to resume an interrupted sweep.
    """
    from scenarios.cli.sweep import sweep_command

    return sweep_command(file, out, options.workers(workers, scheduler, part), as_json)


@app.command()
def view(folders: Annotated[list[Path], typer.Argument(
             metavar="RUN...", help="Folders of `hierarchy run` or `compare`.")],
         side_by_side: Annotated[bool, typer.Option(
             "--side-by-side/--overlay", help="Placement of several runs.")] = True,
         plugin: Plugins = None,
         port: Port = PORT, browser: Browser = True) -> int:
    """Show finished runs in the browser.

    In 3D and as curves; needs the extra `view`.
    """
    from scenarios.cli.view import view_command

    return view_command(folders, port, side_by_side, browser)


@app.command()
def export(folder: Annotated[Path, typer.Argument(
               metavar="RUN", help="Run folder of `hierarchy run`.")],
           format: Annotated[str, typer.Option(
               "--format", metavar="FORMAT", help="mcap. Tables of other formats: "
               "load_run(RUN).to_dataframe() in Python.")] = "mcap",
           out: Annotated[Path | None, output(
               "A new file. Default: run.mcap in RUN.", "FILE")] = None,
           plugin: Plugins = None,
           as_json: AsJson = False) -> None:
    """Export a run as MCAP, with a layout for Foxglove.

    Needs the extra `export`.
    """
    from scenarios import load_run
    from scenarios.export import export as write

    files = [shown(path) for path in write(load_run(folder), out or folder / f"run.{format}")]
    if as_json:
        return print_json({"files": files})
    print(*files, sep="\n")


@app.command()
def replay(folders: Annotated[list[Path], typer.Argument(
               metavar="RUN...", help="Folders of `hierarchy run` or `compare`.")],
           out: Annotated[Path | None, output(
               "HTML file to write. Default: RUN/replay.html.", "FILE")] = None,
           rate: Annotated[float, typer.Option(
               "--rate", metavar="HZ", help="Frames per second.")] = 30.0,
           plugin: Plugins = None) -> int:
    """Write runs as one HTML file that plays without a server."""
    from scenarios.cli.replay import replay_command

    return replay_command(folders, out, rate)


@app.command()
def why(folder: Annotated[Path, typer.Argument(
            metavar="RUN", help="Run folder of `hierarchy run`.")],
        tick: Annotated[int | None, typer.Option(
            "--tick", metavar="N", help="The change into this tick. Default: the three largest.")
            ] = None,
        plugin: Plugins = None, as_json: AsJson = False) -> None:
    """Say why the command of a run jumped: torque, acceleration or speed.

    Bisects between the rows of two ticks.
    """
    from scenarios.cli.why import why_command

    return why_command(folder, tick, as_json)


@app.command()
def figures(folders: Annotated[list[Path], typer.Argument(
                metavar="RUN...", help="Folders of `hierarchy run` or `compare`.")],
            style: Annotated[str, typer.Option(
                "--style", metavar="STYLE",
                help="screen: SVG and PNG. paper: PDF, one column of a journal wide.")] = "screen",
            out: Annotated[Path | None, output(
                "Output folder, new or empty. Default: the run's folder.")] = None,
            plugin: Plugins = None,
            as_json: AsJson = False) -> None:
    """Draw a run's figures again, for screen or paper.

    Several runs are drawn together, as parts (a), (b), ... of the letter's figures.
    """
    from scenarios.cli.figures import redraw

    files = [shown(file) for file in redraw(folders, style, out)]
    if as_json:
        return print_json({"files": files})
    print(*files, sep="\n")


@app.command()
def library(out: Annotated[Path, output("Folder of the library: new or empty, or an existing one "
                                        "with --check.")],
            resolvers: Annotated[str, typer.Option(
                "--resolvers", metavar="NAMES", help="hcod, tpm, recursive, sns.")
                ] = "hcod,tpm,recursive,sns",
            target: Annotated[str, typer.Option(
                "--target", metavar="TARGET", help="native, x86_64 (any) or aarch64 (any).")
                ] = "native",
            compare_: Annotated[bool, typer.Option(
                "--check", help="Write nothing: compare the kernels of the library in the folder "
                                "with those installed.")] = False,
            as_json: AsJson = False) -> int:
    """Write the resolvers as a C library: the same kernels, without Python."""
    from scenarios.cli.library import check_command, library_command

    if compare_:
        return check_command(out, as_json)
    return library_command(out, _split(resolvers), target, as_json)


@app.command()
def check(file: Annotated[str, typer.Argument(help="A scenario or a robot: file or name.",
                                              autocompletion=completion.scenarios)],
          changes: Changes = None, plugin: Plugins = None, as_json: AsJson = False) -> None:
    """Validate and summarize a scenario or robot file.

    Builds it and, for a scenario, runs the first tick.
    """
    from scenarios.cli import robot_check, scenario_check
    from scenarios.loop.first_tick import first_tick

    robot_check.check_known(file)
    if robot_check.is_robot(file):
        robot = robot_check.look_at(file, changes or [])
        return print_json(robot_check.as_plain_data(*robot)) if as_json else print(
            robot_check.say(*robot))
    scenario = _load(file, changes, None)
    found = first_tick(scenario)
    return print_json(scenario_check.as_plain_data(scenario, found)) if as_json else print(
        scenario_check.say(scenario, found))


@app.command("help")
def help_(context: typer.Context, what: Annotated[str | None, typer.Argument(
        metavar="KEY", help="A key of a scenario file, such as avoidance.obstacles.path, or a "
                            "command. Default: all sections and commands.")] = None,
          plugin: Plugins = None) -> None:
    """Say what a key of a scenario file means."""
    from scenarios.cli.help import print_help

    print_help(context, what)


@app.command()
def doctor(as_json: AsJson = False) -> int:
    """Check the installation and run a self-test."""
    from scenarios.cli.doctor import doctor_command

    return doctor_command(as_json)


def _load(name: str, changes: list[str] | None, duration: float | None) -> Scenario:
    """Load a scenario with changes, and add them to its title."""
    from scenarios.config import load

    lengthened = [] if duration is None else [f"control.duration={duration!r}"]
    found = load(name, [*(changes or []), *lengthened])
    if not changes:
        return found
    said = ", ".join(one if len(one) < _LONG else f"{one[:_LONG]}..." for one in changes)
    return found.model_copy(update={"title": f"{found.title or found.name} ({said})"})


def _split(specs: str) -> list[str]:
    named = [spec.strip() for spec in specs.split(",")]
    if not all(named):
        raise typer.BadParameter(f"an empty name in {specs!r}", param_hint="--resolvers")
    return named


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
    return INTERRUPTED


def _fault(text: str) -> int:
    print(f"hierarchy: fault: {text}", file=sys.stderr)
    return 1


def _wrong(text: str) -> int:
    print(f"hierarchy: error: {text}", file=sys.stderr)
    return 2


benchmarks.register(app)
