"""`hierarchy problems`: the problems of the open benchmark, as files."""

from __future__ import annotations

import sys
from collections import Counter
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scenarios.cli.options import AsJson, output, refuse_given
from scenarios.cli.terminal import bar, print_files, print_json, print_lists, shown

if TYPE_CHECKING:
    from solvers.problems.files import Collection

problems = typer.Typer(rich_markup_mode=None, invoke_without_command=True)

Seed = Annotated[int, typer.Option("--seed", min=0, metavar="S",
                                   help="0: the public problems. Any other: fresh ones.")]
Count = Annotated[int | None, typer.Option("--count", min=1, metavar="N",
                                           help="Number of problems. Default: that of the family.")]


@problems.callback()
def main(ctx: typer.Context) -> None:
    """List, show, export and check problems of the open benchmark."""
    if ctx.invoked_subcommand is None:
        print(ctx.get_help())


@problems.command("list")
def list_(as_json: AsJson = False) -> None:
    """List the families of problems."""
    from scenarios.problems.families import FAMILIES

    groups: dict[str, dict[str, str]] = {}
    for one in FAMILIES.values():
        groups.setdefault(one.group, {})[one.name] = one.what
    print_lists(groups, as_json)


@problems.command()
def show(context: typer.Context,
         problem: Annotated[str, typer.Argument(metavar="FAMILY_OR_FILE",
                                                help="Name of a family, or a file.")],
         seed: Seed = 0, count: Count = None, as_json: AsJson = False) -> None:
    """Describe a family or a file: sizes, rows, answers."""
    from scenarios.problems.families import family
    from solvers.problems.files import read

    if is_file := problem.endswith(".npz"):
        refuse_given(context, "is for a family, not for a file", "seed", "count")
    said = _about(read(problem) if is_file else family(problem).half(seed, count))
    if as_json:
        return print_json(said)
    width = max(map(len, said))
    for key, value in said.items():
        print(f"{key:{width}}  {value}")


@problems.command()
def export(family: Annotated[list[str], typer.Argument(
               metavar="FAMILY...", help="Names of families; `all` for all of them.")],
           seed: Seed = 0, count: Count = None, answers: Annotated[bool, typer.Option(
               "--answers/--no-answers", help="Prove the answers too, which takes 0.02 to 2 s for "
               "each problem.")] = True,
           out: Annotated[Path, output("Folder of the files FAMILY-public.npz or "
                                       "FAMILY-fresh-S.npz.")] = Path("problems"),
           as_json: AsJson = False) -> None:
    """Write problems as files, with proved answers."""
    from scenarios.problems import families

    every = family == ["all"]
    chosen = families.available() if every else [families.family(name) for name in family]
    for name, why in (families.unavailable() if every else {}).items():
        print(f"left out: {name}, which {why}", file=sys.stderr)
    files = []
    for one in chosen:
        with bar("problems") as told:
            files.append(families.export(one, seed, count, answers, out, partial(told, one.name)))
    print_files(files, as_json)


@problems.command()
def check(file: Annotated[Path, typer.Argument(metavar="FILE", help="A file of problems.")],
          as_json: AsJson = False) -> int:
    """Read a file, prove its answers again, and compare.

    Exit code 1 if an answer in the file differs.
    """
    from scenarios.problems.families import check as compare
    from solvers.problems.files import read

    collection = read(file)
    wrong = compare(collection)
    if as_json:
        print_json({**_about(collection), "wrong": wrong})
    else:
        known = len(collection.answers or ())
        print(f"{shown(file)}: {len(collection.problems)} problems, {known} answers "
              f"proved again, {len(wrong) or 'none'} differ")
    for p, why in wrong.items():
        print(f"problem {p}: {why}", file=sys.stderr if as_json else sys.stdout)
    return int(bool(wrong))


def _about(collection: Collection) -> dict[str, Any]:
    """Return what there is to say of problems, by heading."""
    head, found = collection.head, collection.problems
    sizes = Counter(tuple(h.sizes.tolist()) for h in found)
    equal = sum(int((h.lower == h.upper).sum()) for h in found)
    rows = sum(h.m for h in found)
    usual = " or ".join(", ".join(map(str, one)) for one, _ in sizes.most_common(2))
    said = {"family": head.family, "what": head.what,
            "half": head.half + (f", seed {head.seed}" if head.seed else ""),
            "problems": len(found),
            "sequence": f"ticks of {1e3 * head.period:g} ms" if head.sequence else "no",
            **{what: " to ".join(dict.fromkeys(map(str, (min(of), max(of))))) if of else "none"
               for what, of in (("unknowns", [h.n for h in found]), ("rows", [h.m for h in found]),
                                ("levels", [len(h.sizes) for h in found]))},
            "usual sizes": (usual or "none") + (", and others" if len(sizes) > 2 else ""),
            "equalities": f"{100.0 * equal / max(rows, 1):.0f} % of the rows",
            "sha256": collection.digest}
    if collection.answers is not None:
        answers = collection.answers
        said |= {"proved": f"{sum(one.complete for one in answers)} completely",
                 "ill-posed": sum(one.posed <= len(h.sizes)
                                  for one, h in zip(answers, found, strict=True)),
                 "largest shift, turn": f"{max((one.shift for one in answers), default=0.0):.1e}, "
                                        f"{max((one.turn for one in answers), default=0.0):.1e}"}
    return said
