"""`hierarchy bench`, every benchmark there is, one command each, and `hierarchy reproduce`."""

import os
from importlib import import_module
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer

from scenarios.cli.options import AsJson, Out, Workers, output, refuse_given
from scenarios.cli.terminal import shown

_ACCURACY, _GROWTH = "solve.first_paper:accuracy", "solve.first_paper:growth"
_STRICTNESS = "peers.moving:strictness"
_USUAL = ("solve.resolvers", "tick", _ACCURACY, _GROWTH, _STRICTNESS, "start")
_DAY = 86_400.0  # [s]
_BESIDE = "cannot be combined with "
_SCENES = {"ellipse": "peers.moving", "stand": "peers.standing"}

Seconds = Annotated[float, typer.Option("--seconds", min=0.001, max=_DAY, metavar="S",
                                        help="Time for all measurements together.")]
Arms = Annotated[int, typer.Option("--arms", min=1, metavar="N", help="Arms of each case.")]
Checked = Annotated[int, typer.Option("--checked", min=1, metavar="N",
                                      help="Arms that are compared with proved answers.")]
Install = Annotated[bool, typer.Option(
    "--install", help="Create an environment for each package and measure nothing.")]
Family = Annotated[list[str] | None, typer.Option(
    "--family", metavar="NAME", help="Only this family. May be repeated.")]


bench = typer.Typer(invoke_without_command=True, rich_markup_mode=None)


def _run(out: Path | None, *names: str, **options: Any) -> int:
    """Run benchmarks, MODULE or MODULE:FUNCTION, with those of the options that each has.

    `out` is an option too, of those that write more than their report.
    """
    from scenarios.files import claim, in_runs, next_free

    folder = next_free(in_runs("bench")) if out is None else claim(out)
    failed = False
    for name in names:
        module, _, function = name.partition(":")
        run = getattr(import_module(f"benchmark.{module}"), function or "run")
        known = signature(run).parameters
        report = run(**{key: value for key, value in {**options, "out": folder}.items()
                        if key in known})
        report.say()
        report.write(folder / (function or module).split(".")[-1] if len(names) > 1 else folder)
        failed = failed or report.failed
    print(f"Numbers: {shown(folder)}")
    return int(failed)


def _installed(packages: tuple[Any, ...]) -> int:
    from benchmark.packages import install

    said = {package.name: install(package) for package in packages}
    print(*(f"{name}: {why or 'installed'}" for name, why in said.items()), sep="\n")
    return int(any(said.values()))


@bench.callback()
def main(ctx: typer.Context, out: Out = None) -> None:
    """Measure speed, accuracy and strictness.

    Without a name: resolvers, tick, accuracy, growth, strictness and start, one after the other.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: one core is timed
    if ctx.invoked_subcommand is None:
        _run(out, *_USUAL)
    else:
        refuse_given(ctx, f"comes after {ctx.invoked_subcommand}", "out")


def _add(name: str, words: str, *modules: str, **options: tuple[Any, Any]) -> None:
    """Add a command that runs benchmarks; options : kinds and defaults of parameters of `run`."""
    def command(**given: Any) -> int:
        return _run(given.pop("out"), *modules, **given)

    every = {**options, "out": (Out, None)}
    command.__annotations__ = {key: kind for key, (kind, _) in every.items()} | {"return": int}
    command.__signature__ = Signature([  # type: ignore[attr-defined]
        Parameter(key, Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for key, (kind, default) in every.items()], return_annotation=int)
    bench.command(name, help=words)(command)


_add("tick", "Time one control tick, compiled and in plain numpy.", "tick")
_add("start", "Measure start-up time, compilation and memory.", "start")
_add("strictness", "Measure whether lower tasks disturb upper ones.", _STRICTNESS)
_add("resolvers", "Time every resolver on the reference problems.", "solve.resolvers",
     seed=(Annotated[int | None, typer.Option(
         "--fresh", min=0, metavar="SEED", help="Also time fresh problems, from this seed on.")],
         None),
     count=(Annotated[int | None, typer.Option(
         "--count", min=1, metavar="N", help="Fresh problems of each family. Default: 200.")],
         None),
     families=(Family, None),
     resolvers=(Annotated[list[str] | None, typer.Option(
         "--resolver", metavar="NAME", help="Only this resolver, with its variants and backends, "
         "beside the yardsticks. May be repeated.")], None),
     seconds=(Annotated[float, typer.Option(
         "--seconds", min=0.001, max=_DAY, metavar="S",
         help="Time for each resolver in each family.")], 0.5))
_add("accuracy", "Measure errors on random arms against proved answers.", _ACCURACY,
     arms=(Arms, 10_000), checked=(Checked, 300))
_add("growth", "Time a solve as the numbers of tasks and joints grow.", _GROWTH,
     seconds=(Seconds, 40.0), larger=(Annotated[bool, typer.Option(
         "--larger", help="Up to 20 tasks, 300 joints and 20 rows a task.")], False))
_add("first-paper", "Repeat the first TPM paper: accuracy and growth.", _ACCURACY, _GROWTH,
     arms=(Arms, 10_000), checked=(Checked, 300), seconds=(Seconds, 40.0))
_add("batch", "Measure how many problems per second batches solve.", "batch",
     counts=(Annotated[list[int] | None, typer.Option(
         "--count", min=1, metavar="N", help="Problems in a batch. May be repeated.")], None),
     seconds=(Annotated[float, typer.Option(
         "--seconds", min=0.001, max=_DAY, metavar="S",
         help="Time for each size of a batch, family and resolver.")], 1.0))


@bench.command()
def peers(context: typer.Context, install: Install = False,
          scene: Annotated[str | None, typer.Option(
              "--scene", metavar="NAME", help="Only `ellipse`, inverse kinematics of an arm, or "
              "`stand`, inverse dynamics of a humanoid on two feet.")] = None,
          out: Out = None) -> int:
    """Compare with other packages for robots.

    They are pink, mink, placo, tsid, embodiK, roboplan and frax. Run it once with --install first.
    Exit code 1 if a package of `--scene stand` is missing.
    """
    from benchmark.packages import PACKAGES
    from hierarchy.errors import check_name

    if install:
        refuse_given(context, _BESIDE + "--install", "scene", "out")
        return _installed(PACKAGES)
    if scene is not None:
        check_name("scene", scene, _SCENES)
        return _run(out, _SCENES[scene])
    _run(out, *_SCENES.values())
    return 0


_add("ik", """Compare inverse kinematics with pink, mink and placo.

    Reachable and unreachable poses of UR5, Panda and both arms of G1, which need the extra
    `descriptions`; for placo run `hierarchy bench peers --install` first.
    """, "peers.reaching", count=(Annotated[int, typer.Option(
         "--count", min=1, metavar="N", help="Poses of each kind and robot.")], 1000))


@bench.command("open")
def open_(context: typer.Context, family: Family = None,
          entrants: Annotated[list[str] | None, typer.Option(
              "--entrant", metavar="LABEL", help="Only this entrant of the table, or FILE.py:CLASS "
              "for yours. May be repeated.")] = None,
          library: Annotated[list[Path] | None, typer.Option(
              "--library", metavar="FILE.so", help="Also a solver in a shared library that has the "
              "functions of benchmark/solve/solver.h. May be repeated.")] = None,
          name: Annotated[list[str] | None, typer.Option(
              metavar="NAME", help="Its name in tables, one for each --library.")] = None,
          fresh: Annotated[list[int] | None, typer.Option(
              "--fresh", metavar="SEED", min=1, help="Seed of fresh problems. May be repeated. "
              "Default: 1.")] = None,
          count: Annotated[int | None, typer.Option(
              "--count", min=1, metavar="N", help="Problems in the public set and in each fresh "
              "one. Default: that of the family.")] = None,
          public: Annotated[int | None, typer.Option(
              "--public", min=1, metavar="N", help="Problems of the public set. Default: that of "
              "--count.")] = None,
          limit: Annotated[float, typer.Option(
              min=0.1, metavar="S", help="Processor time for a problem, also with "
              "--check.")] = 10.0,
          python: Annotated[str, typer.Option(
              metavar="PATH", help="Interpreter that has your entrant's package.")] = "",
          borders: Annotated[bool, typer.Option(
              "--borders", help="Also prove answers for other rank tolerances, 1e-12 to 1e-5; "
              "takes several times as long.")] = False,
          check: Annotated[bool, typer.Option(
              "--check", help="Try the entrants, or the libraries alone, on a few problems of each "
              "kind, in a minute, and store nothing.")] = False,
          install: Install = False,
          out: Annotated[Path, output("Folder to begin or to continue.")] = Path("runs/open")
          ) -> int:
    """Compare solvers on problems with proved answers.

    Run the same command again to resume an interrupted one.
    """
    from benchmark.packages import EMBODIK, HIGHS
    from benchmark.report import tell
    from benchmark.solve import open as opened
    from benchmark.solve.entrants import chosen, compiled
    from scenarios.problems.families import available, unavailable
    from scenarios.problems.families import family as named

    if install:
        refuse_given(context, _BESIDE + "--install", *context.params.keys() - {"install"})
        return _installed((EMBODIK, HIGHS))
    more = compiled(library or [], name or [])
    table = more if check and more and not entrants else chosen(entrants or [], python, more)
    if check:
        refuse_given(context, _BESIDE + "--check", "family", "fresh", "count", "public", "borders",
                     "out")
        tried = opened.check(table, limit)
        tried.say()
        return int(tried.failed)
    for left, why in ({} if family else unavailable()).items():
        tell(f"left out: {left}, which {why}")
    counts = {0: public or count, **dict.fromkeys(fresh or [1], count)}
    opened.run(out, [named(one) for one in family or ()] or available(), table, counts, limit)
    if borders:
        opened.prove_at_borders(out)
    found = opened.report(out)
    found.say()
    found.write(out)
    print(f"\nPage: {shown(out / 'index.html')}")
    return 0


_add("stress", """Certify a resolver's answers to generated problems.

    What is not certified is proved right or wrong, and what fails is saved. Exit code 1 if an
    answer fails.
    """, "stress",
     count=(Annotated[int, typer.Option(
         min=1, metavar="N", help="Number of problems, rounded up to as many of each kind.")],
         1_000_000),
     resolver=(Annotated[str, typer.Option(metavar="NAME", help="Resolver to test.")], "hcod"),
     kind=(Annotated[str, typer.Option(metavar="KIND", help="Kind of problems.")], "all"),
     first=(Annotated[int, typer.Option(min=0, max=2**53, metavar="SEED", help="First seed.")], 0),
     processes=(Annotated[int | None, typer.Option(
         "--processes", min=1, metavar="N", help="Default: one for each core.")], None))


def reproduce(context: typer.Context, names: Annotated[list[str] | None, typer.Argument(
                  metavar="[NAME]...", help="`protocol`, the runs of docs/protocol.md, `fronts`, "
                  "tuned methods, or a page such as docs/results/problems.md for the commands in "
                  "it. Default: all.")] = None,
              out: Annotated[Path, output("Where the runs are stored.")] = Path("runs/reproduce"),
              quick: Annotated[bool, typer.Option(
                  "--quick", help="The first seed only; leave the documents as they are.")] = False,
              fill: Annotated[bool, typer.Option(
                  "--fill", help="Run nothing; write the pages from what docs/results has.")
                  ] = False,
              workers: Workers = None, as_json: AsJson = False) -> int:
    """Regenerate the numbers in the documentation.

    They are written into the pages of a checkout as each seed or command ends. Run the same
    command again to resume an interrupted one. Nothing else should run while timings are made.
    Exit code 1 if a command ends with an error: its output stays as it was.
    """
    from benchmark.reproduce import whole

    if fill:
        refuse_given(context, _BESIDE + "--fill", *context.params.keys() - {"fill"})
    return whole.fill() if fill else whole.run(names or [], out, quick, workers, as_json)
