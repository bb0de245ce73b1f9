"""The command `hierarchy`: list, run, compare, sweep, check, bench.

Nothing heavy is imported before it is needed, so that `--help` and completion answer at once.
Exit codes: 0 done, 1 a run ended in a fault that is reported, 2 the command line or a file is
wrong.
"""

from __future__ import annotations

import os
import re
import shlex
import sys
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from rich.table import Table

    from scenarios.compare import Row, Run
    from scenarios.config import Scenario

app = typer.Typer(help="Prioritized robot tasks: many ways of resolving them, compared.",
                  rich_markup_mode=None, pretty_exceptions_enable=False)

Changes = Annotated[list[str] | None, typer.Option(
    "--set", metavar="KEY=VALUE",
    help="Change the scenario: a dotted key and a TOML value. May be repeated.")]
Duration = Annotated[float | None, typer.Option(
    "--duration", metavar="SECONDS", help="Run for so long instead of the scenario's duration.")]
Out = Annotated[Path | None, typer.Option(
    "--out", metavar="FOLDER", help="Where to write; new or empty. Default: a new one in runs/.")]


_BESIDE = 5  # runs that a table of 80 columns holds


class Bench(StrEnum):
    """What can be measured."""

    resolvers = "resolvers"
    tick = "tick"
    first_paper = "first-paper"
    strictness = "strictness"
    start = "start"
    peers = "peers"


_ASKED_FOR = (Bench.peers,)  # minutes, and packages of others


def main() -> None:
    """Run the command line and exit with its code; see the module's text."""
    sys.exit(run_command(sys.argv[1:]))


def run_command(arguments: list[str]) -> int:
    """Run one command line and return its exit code; mistakes become one line on stderr."""
    try:
        return int(app(arguments or ["--help"], prog_name="hierarchy", standalone_mode=False) or 0)
    except typer.TyperException as error:
        return _wrong(error.format_message())
    except (KeyboardInterrupt, typer.Abort):
        print("hierarchy: interrupted", file=sys.stderr)
        return 1
    except Exception as error:
        from hierarchy.errors import HierarchyError

        if isinstance(error, HierarchyError):
            return _wrong(str(error))
        raise


@app.command("list")
def list_() -> None:
    """List the scenarios, sweeps, resolvers, tasks and robots there are."""
    import solvers
    from hierarchy.robot import ROBOTS
    from hierarchy.tasks import TASKS
    from scenarios.config import load, shipped
    from scenarios.sweep.config import load_sweep, shipped_sweeps

    _print_list("scenarios", {name: load(name).title for name in shipped()})
    _print_list("sweeps", {name: load_sweep(name).title for name in shipped_sweeps()})
    _print_list("resolvers", {name: _first_line(solvers.make(name))
                               for name in solvers.names()})
    _print_list("tasks", {name: _first_line(task) for name, task in TASKS.items()})
    _print_list("robots", dict.fromkeys(ROBOTS, ""))


@app.command()
def run(scenario: Annotated[str, typer.Argument(help="Name of a scenario, or a scenario file.")],
        resolver: Annotated[str | None, typer.Option(
            "--resolver", metavar="SPEC",
            help="Another resolver: name, or name:setting=value:setting=value.")] = None,
        changes: Changes = None, duration: Duration = None, out: Out = None,
        certify: Annotated[bool, typer.Option(
            "--certify", help="Certify the answer of every tick, outside the times measured.")
            ] = False) -> int:
    """Run one scenario, measure it, keep the run in a folder."""
    chosen = _load(scenario, changes, duration)
    if resolver is not None:
        chosen = chosen.with_resolver(resolver)
    from scenarios.folders import claim, next_free

    name = f"{chosen.name}-{chosen.control.resolver}"
    folder = claim(out if out is not None else next_free(Path("runs") / name))
    from scenarios.progress import bar
    from scenarios.recording import save
    from scenarios.simulate import simulate

    with bar() as told:
        label = str(chosen.make_resolver().label)
        recording = simulate(chosen, progress=partial(told, label) if told else None,
                             certified=certify)
    save(recording, folder)
    _print_table([_run_of(chosen, recording)])
    if certify:
        print(f"\n{_verdict(recording, chosen.make_resolver().damping)}")
    for line in _troubles(recording):
        print(line)
    print(f"\n{recording.ticks} ticks in {_shown(folder)}")
    return _fault(recording.fault)


@app.command()
def compare(scenarios: Annotated[list[str], typer.Argument(
                help="Names of scenarios, or scenario files.")],
            resolvers: Annotated[str | None, typer.Option(
                "--resolvers", metavar="SPEC,SPEC,...",
                help="Resolvers: name, or name:setting=value. Default: all that suit.")] = None,
            changes: Changes = None, duration: Duration = None, out: Out = None) -> int:
    """Run scenarios under several resolvers; write a report."""
    from scenarios.compare import compare as run_all
    from scenarios.compare import default_resolvers
    from scenarios.folders import next_free
    from scenarios.progress import bar

    chosen = [_load(name, changes, duration) for name in scenarios]
    specs = None if resolvers is None else _split(resolvers)
    missing: dict[str, str] = {}
    for scenario in chosen if specs is None else ():
        missing |= default_resolvers(scenario.asks)[1]
    for spec, remedy in missing.items():
        print(f"left out: {spec} is not installed; {remedy}")
    folder = out if out is not None else next_free(Path("runs") / f"compare-{chosen[0].name}")
    command = shlex.join(["hierarchy", *sys.argv[1:]])
    with bar() as told:
        comparison = run_all(chosen, specs, out=folder, progress=told, command=command)
    for runs in comparison.groups().values():
        _print_table(runs)
    print("", *comparison.refused, sep="\n" if comparison.refused else "")
    print(f"\nReport: {_shown(folder / 'index.html')}")
    return max([_fault(f"{run.label}: {run.fault}") for run in comparison.faults], default=0)


@app.command()
def sweep(file: Annotated[str, typer.Argument(help="Name of a sweep, or a sweep file.")],
          out: Annotated[Path | None, typer.Option(
              "--out", metavar="FOLDER",
              help="Where to write, or to go on. Default: runs/sweep-NAME.")] = None,
          workers: Annotated[int | None, typer.Option(
              "--workers", metavar="N", min=1,
              help="Processes on this machine. Default: one for each processor.")] = None,
          scheduler: Annotated[str | None, typer.Option(
              "--scheduler", metavar="ADDRESS",
              help="Use the workers of this Dask scheduler instead.")] = None) -> int:
    """Run scenarios under resolvers with sampled parameters; go on where that stopped."""
    from scenarios.sweep.command import sweep_command

    return sweep_command(file, out, workers, scheduler)


@app.command()
def check(file: Annotated[str, typer.Argument(help="A scenario file, or a scenario's name.")],
          changes: Changes = None) -> None:
    """Read a scenario file and say what was understood."""
    scenario = _load(file, changes, None)
    ticks = round(scenario.control.duration / scenario.control.period)
    print(f"{scenario.name}: {scenario.title}")
    print(f"  robot     {scenario.robot.model}")
    print(f"  control   {scenario.control.level} level, {ticks} ticks of "
          f"{1e3 * scenario.control.period:g} ms")
    print(f"  plant     {scenario.plant.kind}")
    print(f"  resolver  {scenario.make_resolver()!r}")
    if scenario.pointing is not None:
        print(f"  pointing  {scenario.pointing.kind}, cone of {scenario.pointing.alpha_d:g} deg")
    if scenario.avoidance is not None:
        asked = scenario.avoidance
        body, tip = (" and ".join(f"{distance:g}" for distance in thresholds.values())
                     for thresholds in (asked.thresholds, asked.tip_thresholds))
        print(f"  avoidance {asked.kind}, {len(asked.obstacles)} obstacles; within {body} m of the "
              f"body, {tip} m of the end effector")
    if scenario.limits is not None:
        print(f"  limits    positions and velocities of the robot, "
              f"{scenario.limits.acceleration} rad/s^2, "
              f"{'in the stack' if scenario.limits_in_stack else 'as a guard outside the stack'}")
    print("The file is right.")


@app.command()
def bench(what: Annotated[Bench | None, typer.Argument(
        help="Only this. Default: all but peers.")] = None, out: Out = None) -> None:
    """Time resolvers, control tick, start, others' packages; judge errors and strictness."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: one core is timed
    from importlib import import_module

    from scenarios.folders import claim, next_free

    folder = claim(out if out is not None else next_free(Path("runs") / "bench"))
    for wanted in [what] if what is not None else [b for b in Bench if b not in _ASKED_FOR]:
        import_module(f"scenarios.bench.{wanted.name}").run(folder)
    print(f"\nNumbers: {_shown(folder)}")


def _load(name: str, changes: list[str] | None, duration: float | None) -> Scenario:
    from scenarios.config import load

    lengthened = [] if duration is None else [f"control.duration={duration!r}"]
    return load(name, [*(changes or []), *lengthened])


def _split(specs: str) -> list[str]:
    named = [spec.strip() for spec in specs.split(",") if spec.strip()]
    if not named:
        raise typer.BadParameter("names no resolver", param_hint="--resolvers")
    return named


def _run_of(scenario: Scenario, recording: Any) -> Run:
    from scenarios.compare import Run

    return Run(scenario, scenario.control.resolver, str(scenario.make_resolver().label), recording)


def _troubles(recording: Any) -> list[str]:
    """Say of each kind of trouble what was done, how often, and when first."""
    lines = [f"{kind}: {action} in {len(ticks)} ticks, first in tick {ticks[0]} "
             f"(t = {recording['t'][ticks[0]]:.3f} s)"
             for (kind, action), ticks in recording.troubles().items()]
    return ["", *lines] if lines else []


def _verdict(recording: Any, damping: float) -> str:
    """Say how many ticks were certified and which is the first that was not."""
    certified = recording["certified"]
    text = f"certified: {certified.sum()} of {recording.ticks} ticks"
    if certified.all():
        return text
    first = int(certified.argmin())
    text += f"; the first that is not is tick {first} (t = {recording['t'][first]:.3f} s)"
    if damping > 0.0:
        text += (f"\n(damping = {damping:g}: near a singularity the answer is meant to differ from "
                 "the undamped one, which is what is certified)")
    return text


def _print_table(runs: list[Run]) -> None:
    from rich.console import Console

    from scenarios.compare import table
    from scenarios.parting import partings

    console = Console(markup=False, highlight=False)
    titles = dict.fromkeys(one.scenario.title or one.scenario.name for one in runs)
    print("", *titles, sep="\n")
    rows = table(runs, details=False)
    beside = -(-len(runs) // -(-len(runs) // _BESIDE))  # so that tables are about equally wide
    for first in range(0, len(runs), beside):
        print()
        console.print(_table(runs, rows, range(first, min(first + beside, len(runs)))))
    said = [str(one) for one in partings(runs)]
    if said:
        console.print("", *said, sep="\n")


def _table(runs: list[Run], rows: list[Row], chosen: range) -> Table:
    """Lay metrics of the chosen runs out for a terminal, best of all in bold with a star."""
    from rich.table import Table
    from rich.text import Text

    laid_out = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    laid_out.add_column("", overflow="fold")
    for i in chosen:
        head = re.sub(r"(?<=[^ :-])[ :-]", _broken, runs[i].label)
        laid_out.add_column(Text(head), justify="right", no_wrap=True)
    for row in rows:
        cells = [Text(row.cells[i] + ("*" if i in row.best else " "),
                      "bold" if i in row.best else "") for i in chosen]
        laid_out.add_row(Text(f"{row.label} [{row.unit}]" if row.unit else row.label), *cells)
    return laid_out


def _broken(separator: re.Match[str]) -> str:
    """Break a column's head after a colon or hyphen, or instead of a space."""
    return f"{separator[0].strip()}\n"


def _print_list(what: str, entries: dict[str, str]) -> None:
    print(f"{what}:")
    width = max((len(name) for name in entries), default=0)
    for name, text in entries.items():
        print(f"  {name:{width}}  {text}".rstrip())


def _first_line(thing: Any) -> str:
    return (thing.__doc__ or "").strip().partition("\n")[0]


def _shown(path: Path) -> str:
    path = path.resolve()
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def _fault(fault: str | None) -> int:
    if fault is None:
        return 0
    print(f"hierarchy: fault: {fault}", file=sys.stderr)
    return 1


def _wrong(text: str) -> int:
    print(f"hierarchy: error: {text}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    main()
