"""`hierarchy run`, `compare` and `sweep`: make runs, and print what came of them."""

from __future__ import annotations

import shlex
import sys
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated

import typer

from scenarios.cli import options as opt
from scenarios.cli import terminal
from scenarios.cli.terminal import bar, exit_code, interruptible, print_json, shown

if TYPE_CHECKING:
    from collections.abc import Callable

    from scenarios.config import Scenario
    from scenarios.results.sampled import Finished


@opt.app.command()
def run(context: typer.Context, scenario: Annotated[str, typer.Argument(
            help="Name of a scenario, or a scenario file.",
            autocompletion=opt.names_of("scenarios"))],
        resolver: Annotated[str | None, typer.Option(
            "--resolver", metavar="SPEC", autocompletion=opt.complete_resolvers,
            help="Use another resolver: name, or name:setting=value:setting=value.")] = None,
        changes: opt.Changes = None, plugin: opt.Plugins = None, duration: opt.Duration = None,
        out: opt.Out = None, certify: Annotated[bool, typer.Option(
            "--certify", help="Certify the answer of every tick, outside the measured times.")
            ] = False,
        figures: Annotated[bool, typer.Option(
            "--figures", help="Also draw the run's figures, like `hierarchy figures`.")
            ] = False, as_json: opt.AsJson = False,
        live: Annotated[bool, typer.Option(
            "--live", help="Show the run in the browser and change it interactively.")] = False,
        speed: Annotated[float, typer.Option(
            "--speed", metavar="X", min=0.01, max=100.0, help="With --live: real-time factor.")
            ] = 1.0,
        wait: Annotated[bool, typer.Option(
            "--wait/--no-wait", help="With --live: start when a browser has opened the page, or "
            "at once.")] = True,
        port: opt.Port = opt.PORT, browser: opt.Browser = True) -> int:
    """Run a scenario, measure it, and save the run."""
    if live:
        opt.refuse_given(context, "cannot be combined with --live", "certify", "figures", "as_json")
    else:
        opt.refuse_given(context, "needs --live", "speed", "wait", "port", "browser")
    chosen = opt.loaded(scenario, changes, duration)
    if resolver is not None:
        chosen = chosen.with_resolver(resolver)
    from scenarios.files import claim, in_runs, next_free

    name = f"{chosen.name}-{chosen.control.resolver}"
    folder = next_free(in_runs(name)) if out is None else claim(out)
    if live:
        from scenarios.cli.shown import show_live

        return show_live(chosen, folder, port, speed, browser, wait)
    return _run(chosen, folder, certify, figures, as_json)


def _run(scenario: Scenario, folder: Path, certify: bool, figures: bool, as_json: bool) -> int:
    from scenarios.config.validation import doubtful_units
    from scenarios.loop.first_tick import contact_warnings
    from scenarios.loop.simulation import simulate
    from scenarios.measure.metrics import as_plain_data
    from scenarios.measure.run_folder import kept
    from scenarios.measure.runs import Run
    from scenarios.measure.verdict import verdict

    for text in (*doubtful_units(scenario), *contact_warnings(scenario)):
        print(f"hierarchy: warning: {text}", file=sys.stderr)
    with bar() as told:
        recording = simulate(scenario, certified=certify,
                             progress=partial(told, str(scenario.make_resolver().label)))
    if lost := kept(recording, folder):
        return exit_code(lost)
    if figures and recording.ticks > 1:
        from scenarios.draw.figures.letter import redraw

        redraw([folder])
    if as_json:
        print_json({"scenario": scenario.name, "resolver": scenario.control.resolver,
                    "folder": shown(folder), **as_plain_data(recording),
                    **verdict(recording).as_plain_data()})
    else:
        resolver = scenario.make_resolver()
        made = Run(scenario, scenario.control.resolver, str(resolver.label), recording)
        terminal.print_table([made])
        if certify:
            print(f"\n{terminal.certified(recording, resolver.damping)}")
        print(*terminal.troubles(recording), "", terminal.kept_in(folder, recording), sep="\n")
    return exit_code(recording.fault)


@opt.app.command()
def compare(context: typer.Context, scenarios: Annotated[list[str], typer.Argument(
                help="Names of scenarios or groups, or scenario files.",
                autocompletion=opt.names_of("scenarios", "groups"))],
            resolvers: Annotated[str | None, typer.Option(
                "--resolvers", metavar="SPEC,SPEC,...", autocompletion=opt.complete_resolvers,
                help="Resolvers: name, or name:setting=value; or own, that of each scenario. "
                     "Default: a selection of suitable ones; own for a group.")] = None,
            changes: opt.Changes = None, plugin: opt.Plugins = None, duration: opt.Duration = None,
            out: Annotated[Path | None, opt.output(
                "Output folder, new or empty; with --starts also one to resume. Default: a new "
                "folder in runs/; with --starts runs/starts-NAME.")] = None,
            starts: Annotated[int | None, typer.Option(
                "--starts", metavar="N", min=2, help="Compare over N starts sampled from each "
                "scenario's [variation].")] = None,
            seed: Annotated[int, typer.Option(
                "--seed", metavar="S", min=0, help="With --starts: seed of the samples.")] = 0,
            workers: opt.Workers = None, scheduler: opt.Scheduler = None, part: opt.Part = None,
            as_json: opt.AsJson = False) -> int:
    """Run scenarios under several resolvers and report.

    With --starts every resolver gets the same sampled starts, and the report gives statistics; run
    the same command again to resume an interrupted comparison.
    """
    if starts is None:
        opt.refuse_given(context, "needs --starts", "seed", "scheduler", "part")
    if scheduler:
        opt.refuse_given(context, "cannot be combined with --scheduler", "workers")
    from scenarios.config import members, shipped_groups
    from scenarios.config.scenario import OWN
    from scenarios.files import in_runs, next_free

    chosen = [opt.loaded(name, changes, duration) for name in members(scenarios)]
    grouped = any(name in shipped_groups() for name in scenarios)
    specs = opt.listed_in(resolvers) if resolvers is not None else [OWN] if grouped else None
    if starts is None:
        name = scenarios[0] if grouped else chosen[0].name
        folder = out if out is not None else next_free(in_runs(f"compare-{name}"))
        return _compare(chosen, specs, folder, as_json, workers)
    from scenarios.results.sampled import Workers, compare_starts

    folder = out if out is not None else in_runs(f"starts-{chosen[0].name}")
    return _sampled(partial(compare_starts, chosen, specs, starts, seed, folder,
                            workers=Workers(workers, scheduler, part)), folder, as_json)


def _compare(scenarios: list[Scenario], resolvers: list[str] | None, folder: Path,
             as_json: bool, workers: int | None) -> int:
    from scenarios.config.resolvers import default_resolvers
    from scenarios.results.comparing import compare
    from solvers.batch import cores

    missing: dict[str, str] = {}
    for scenario in scenarios if resolvers is None else ():
        missing |= default_resolvers(scenario.asks)[1]
    for spec, remedy in missing.items():
        print(f"skipped: {spec} is not installed; {remedy}",
              file=sys.stderr if as_json else sys.stdout)
    count = workers or cores()
    with (interruptible(f"the runs made so far are in {shown(folder)}", folder),
          bar("runs" if count > 1 else "ticks") as told):
        comparison = compare(scenarios, resolvers, out=folder, progress=told,
                             command=_command_line(), workers=count)
    report = shown(folder / "index.html")
    if as_json:
        print_json({"report": report, **comparison.as_plain_data()})
    else:
        for runs in comparison.groups().values():
            terminal.print_table(runs)
        print(*(["", *comparison.refused] if comparison.refused else []), "", f"Report: {report}",
              sep="\n")
    codes = [max(exit_code(f"{run.label}: {run.fault}"), opt.INTERRUPTED * run.interrupted)
             for run in comparison.faults]
    return max(codes, default=0)


@opt.app.command()
def sweep(context: typer.Context,
          file: Annotated[str, typer.Argument(help="Name of a sweep, or a sweep file.",
                                              autocompletion=opt.names_of("sweeps"))],
          out: Annotated[Path | None, opt.output(
              "Output folder, new or of a sweep to resume. Default: runs/sweep-NAME.")] = None,
          plugin: opt.Plugins = None, workers: opt.Workers = None, scheduler: opt.Scheduler = None,
          part: opt.Part = None, as_json: opt.AsJson = False) -> int:
    """Run scenarios with sampled parameters.

    Run the same command again to resume an interrupted sweep.
    """
    if scheduler:
        opt.refuse_given(context, "cannot be combined with --scheduler", "workers")
    from scenarios.files import in_runs
    from scenarios.results.plan import load_sweep
    from scenarios.results.sampled import Workers
    from scenarios.results.sampled import sweep as make

    folder = out if out is not None else in_runs(f"sweep-{load_sweep(file).name}")
    return _sampled(partial(make, file, folder, workers=Workers(workers, scheduler, part)), folder,
                    as_json)


def _sampled(make: Callable[..., Finished], folder: Path, as_json: bool) -> int:
    """Make sampled runs, print their statistics; return 0 if a run finished or a part is made."""
    from scenarios.results.store import TABLE

    begun = perf_counter()
    with (interruptible(f"finished runs are in {folder}, and the same command continues from "
                        "there", folder), bar("runs") as told):
        done = make(progress=told, command=_command_line())
    seconds, runs = perf_counter() - begun, len(done.plan.runs)
    if as_json:
        print_json({"folder": str(folder), "report": str(folder / "index.html"),
                    "table": str(folder / TABLE), "statistics": str(folder / "results.json"),
                    "runs": runs, "made_now": done.made, "did_not_reach_their_end": done.failed,
                    "refused": list(done.plan.refused)})
        return int(done.failed == runs)
    for name, results in done.found.items():
        terminal.print_samples(name, results)
    if done.plan.refused:
        print("", *done.plan.refused, sep="\n")
    if not done.found:
        print(f"{done.made} runs of this part made in {folder}; {seconds:.0f} s\n"
              "After all parts, the same command without --part makes the table and the page.")
        return 0
    kept = f", {runs - done.made} of them from before" if done.made < runs else ""
    print(f"\n{runs} runs{kept}; {done.failed} did not finish; {seconds:.0f} s")
    print(f"Report: {folder / 'index.html'}")
    return int(done.failed == runs)


def _command_line() -> str:
    return shlex.join(["hierarchy", *sys.argv[1:]])
