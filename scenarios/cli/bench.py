"""`hierarchy bench`: every benchmark there is, one command each."""

from __future__ import annotations

import os
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from scenarios.bench.first_paper import ARMS, CHECKED, SECONDS
from scenarios.cli.options import Out, output
from scenarios.cli.terminal import shown

_USUAL = ("resolvers", "tick", "first_paper", "strictness", "start")  # modules of scenarios.bench

Seconds = Annotated[float, typer.Option("--seconds", min=0.001, metavar="S",
                                        help="Time for all measurements together.")]


class _Benchmarks(typer.core.TyperGroup):
    """Suggests the nearest benchmark for an unknown name."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        if args and not args[0].startswith("-") and args[0] not in self.commands:
            from hierarchy.errors import UnknownNameError

            raise UnknownNameError("benchmark", args[0], list(self.commands))
        return super().resolve_command(ctx, args)


bench = typer.Typer(cls=_Benchmarks, invoke_without_command=True, rich_markup_mode=None)


@bench.callback()
def main(ctx: typer.Context, out: Out = None) -> None:
    """Measure speed, accuracy and strictness.

    Without a name: resolvers, tick, first-paper, strictness and start, one after the other.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: one core is timed
    if ctx.invoked_subcommand is None:
        folder = _claimed(out)
        for name in _USUAL:
            import_module(f"scenarios.bench.{name}").run(folder)
        _say(folder)


@bench.command()
def resolvers(
        fresh: Annotated[int | None, typer.Option(
            "--fresh", metavar="SEED", help="Time new problems too, from this seed on.")] = None,
        count: Annotated[int, typer.Option(
            "--count", min=1, metavar="N", help="New problems of each family.")] = 200,
        family: Annotated[list[str] | None, typer.Option(
            "--family", metavar="NAME", help="Only this family. May be repeated.")] = None,
        resolver: Annotated[list[str] | None, typer.Option(
            "--resolver", metavar="NAME",
            help="Only this resolver, with its variants and backends, beside the yardsticks. May "
                 "be repeated.")] = None,
        seconds: Annotated[float, typer.Option(
            "--seconds", min=0.001, metavar="S",
            help="Time for each resolver in each family.")] = 0.5,
        out: Out = None) -> None:
    """Time every resolver on the reference problems."""
    from scenarios.bench.families import FAMILIES
    from scenarios.bench.resolvers import run

    folder = _claimed(out)
    run(folder, seconds, families=family or FAMILIES, seed=fresh, count=count, resolvers=resolver)
    _say(folder)


@bench.command()
def tick(out: Out = None) -> None:
    """Time one control tick, compiled and in plain numpy."""
    from scenarios.bench.tick import run

    folder = _claimed(out)
    run(folder)
    _say(folder)


@bench.command()
def start(out: Out = None) -> None:
    """Measure start-up time, compilation and memory."""
    from scenarios.bench.start import run

    folder = _claimed(out)
    run(folder)
    _say(folder)


@bench.command()
def strictness(out: Out = None) -> None:
    """Measure whether lower tasks disturb upper ones."""
    from scenarios.bench.strictness import run

    folder = _claimed(out)
    run(folder)
    _say(folder)


Arms = Annotated[int, typer.Option("--arms", min=1, metavar="N", help="Arms of each case.")]
Checked = Annotated[int, typer.Option("--checked", min=1, metavar="N",
                                      help="Arms that are compared with exact answers.")]


@bench.command()
def accuracy(arms: Arms = ARMS, checked: Checked = CHECKED, out: Out = None) -> None:
    """Measure errors on random arms against exact answers."""
    from scenarios.bench.first_paper import errors

    folder = _claimed(out)
    errors(folder, arms, checked)
    _say(folder)


@bench.command()
def growth(seconds: Seconds = SECONDS, out: Out = None) -> None:
    """Time a solve as the numbers of tasks and joints grow."""
    from scenarios.bench.first_paper import times

    folder = _claimed(out)
    times(folder, seconds)
    _say(folder)


@bench.command("first-paper")
def first_paper(arms: Arms = ARMS, checked: Checked = CHECKED, seconds: Seconds = SECONDS,
                out: Out = None) -> None:
    """Repeat the first TPM paper: accuracy and growth."""
    from scenarios.bench.first_paper import run

    folder = _claimed(out)
    run(folder, arms, checked, seconds)
    _say(folder)


@bench.command()
def batch(count: Annotated[list[int] | None, typer.Option(
              "--count", min=1, metavar="N", help="Problems in a batch. May be repeated.")] = None,
          seconds: Seconds = 1.0, out: Out = None) -> None:
    """Measure how many problems per second batches solve."""
    from scenarios.bench.batch import COUNTS, run

    folder = _claimed(out)
    run(folder, count or COUNTS, seconds)
    _say(folder)


@bench.command()
def peers(install: Annotated[bool, typer.Option(
              "--install", help="Create an environment for each package and measure nothing.")
              ] = False,
          scene: Annotated[str | None, typer.Option(
              "--scene", metavar="NAME", help="Only `ellipse`, inverse kinematics of an arm, or "
              "`stand`, inverse dynamics of a humanoid on two feet.")] = None,
          out: Out = None) -> int:
    """Compare with pink, mink, placo, tsid, embodiK, roboplan and frax.

    Run it once with --install first. Exit code 1 if a package of `--scene stand` is missing.
    """
    from hierarchy.errors import UnknownNameError

    if scene not in (None, *_SCENES):
        raise UnknownNameError("scene", str(scene), _SCENES)
    if install:
        from scenarios.bench.peers.environments import install as install_all

        said = install_all()
        for name, why in said.items():
            print(f"{name}: {why or 'installed'}")
        return int(any(said.values()))
    from scenarios.bench.peers import run
    from scenarios.bench.peers.stand.compare import ENTRANTS
    from scenarios.bench.peers.stand.compare import run as run_stand

    folder = _claimed(out)
    if scene != "stand":
        run(folder)
    rows = [] if scene == "ellipse" else run_stand(folder)
    _say(folder)
    return int(scene == "stand" and len(rows) < len(ENTRANTS))


_SCENES = ("ellipse", "stand")


@bench.command()
def ik(count: Annotated[int, typer.Option("--count", min=1, metavar="N",
                                          help="Poses of each kind and robot.")] = 1000,
       out: Out = None) -> None:
    """Find configurations for poses beside pink, mink and placo.

    Reachable and unreachable poses of UR5, Panda and both arms of G1, which need
    example-robot-data; for placo run `hierarchy bench peers --install` first.
    """
    from scenarios.bench.ik import run

    folder = _claimed(out)
    run(folder, count)
    _say(folder)


@bench.command("open")
def open_(families: Annotated[list[str] | None, typer.Option(
              "--family", metavar="NAME", help="Only this family. May be repeated.")] = None,
          entrants: Annotated[list[str] | None, typer.Option(
              "--entrant", metavar="LABEL", help="Only this entrant of the table, or FILE.py:CLASS "
              "for yours. May be repeated.")] = None,
          fresh: Annotated[list[int] | None, typer.Option(
              "--fresh", metavar="SEED", min=1, help="Seed of fresh problems. May be repeated. "
              "Default: 1.")] = None,
          count: Annotated[int | None, typer.Option(
              "--count", min=1, metavar="N", help="Problems of a half. Default: 50, or 200 "
              "consecutive ones.")] = None,
          public: Annotated[int | None, typer.Option(
              "--public", min=1, metavar="N", help="Problems of the public half. Default: that of "
              "--count.")] = None,
          limit: Annotated[float, typer.Option("--limit", min=0.1, metavar="S",
                                               help="Time for one problem.")] = 10.0,
          python: Annotated[str, typer.Option(
              "--python", metavar="PATH", help="Interpreter that has your entrant's package.")
              ] = "",
          soth: Annotated[Path | None, typer.Option(
              "--soth", metavar="DIR", help="Your checkout of soth, compiled here.")] = None,
          lexls: Annotated[Path | None, typer.Option(
              "--lexls", metavar="DIR", help="Your checkout of LexLS, compiled here.")] = None,
          check: Annotated[bool, typer.Option(
              "--check", help="Try the entrants on a few problems of each kind, in a minute, and "
              "keep nothing.")] = False,
          install: Annotated[bool, typer.Option(
              "--install", help="Make an environment for each package, and measure nothing.")
              ] = False,
          out: Annotated[Path, output("Folder to begin or to continue.")] = Path("runs/open")
          ) -> int:
    """Compare solvers on public and fresh problems with proved answers.

    The same command continues what was interrupted.
    """
    from scenarios.cli.open_benchmark import check_command, install_command, open_command

    if install:
        return install_command()
    built = {"soth": soth, "lexls": lexls}
    if check:
        return check_command(entrants or [], python, built)
    counts = {0: public or count, **dict.fromkeys(fresh or [1], count)}
    return open_command(families or [], entrants or [], counts, limit, python, built, out)


@bench.command()
def stress(count: Annotated[int, typer.Option("--count", min=1, metavar="N",
                                              help="Number of problems.")] = 1_000_000,
           resolver: Annotated[str, typer.Option("--resolver", metavar="NAME",
                                                 help="Resolver to test.")] = "hcod",
           kind: Annotated[str, typer.Option("--kind", metavar="KIND",
                                             help="Kind of problems.")] = "all",
           first: Annotated[int, typer.Option("--first", min=0, metavar="SEED",
                                              help="First seed.")] = 0,
           processes: Annotated[int | None, typer.Option(
               "--processes", min=1, metavar="N", help="Default: one for each core.")] = None,
           out: Annotated[Path, output("Where failing problems are kept.")
                          ] = Path("runs/stress")) -> int:
    """Certify a resolver on generated problems.

    Exit code 1 if an answer fails.
    """
    from hierarchy.errors import UnknownNameError
    from scenarios.bench.stress import ALL, KINDS, run
    from solvers import make

    make(resolver)
    if kind not in (ALL, *KINDS):
        raise UnknownNameError("kind", kind, (ALL, *KINDS))
    return int(not run(count, resolver, first, processes, out, kind).passed)


def _claimed(out: Path | None) -> Path:
    from scenarios.files import claim, next_free

    return claim(out if out is not None else next_free(Path("runs") / "bench"))


def _say(folder: Path) -> None:
    print(f"\nNumbers: {shown(folder)}")
