"""Make the runs of the protocol and the outputs of commands, store them, and write the pages."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter

from benchmark.report import tell
from benchmark.reproduce import fronts, pages, protocol
from benchmark.reproduce.blocks import POINTS, ROWS, Stored, every, said
from benchmark.reproduce.protocol import PROTOCOL, Rows
from hierarchy.errors import check_name, refuse
from scenarios.cli.terminal import bar, interruptible, print_json, shown
from scenarios.files import make_folder, write_json, write_text
from scenarios.results.sampled import Workers

NAME, TUNED = "protocol", "fronts"  # of the runs


def fill() -> int:
    """Write the pages of the checkout from the rows and outputs that are stored."""
    written, lacking = pages.fill(pages.ROOT, Stored.read(pages.ROOT))
    print(*map(shown, written), sep="\n")
    refuse(lacking, "; ".join(lacking))
    return 0


def run(names: list[str], out: Path, quick: bool = False, workers: int | None = None,
        as_json: bool = False) -> int:
    """Make runs and outputs, of all without names; print the verdicts.

    Unless `quick`, the pages are written as each ends. Returns 1 if a command did not end well.
    Raises UnknownNameError.
    """
    begun, known = perf_counter(), (NAME, TUNED, *pages.marked(pages.ROOT))
    for name in names:
        check_name("page", name, known)
    asked = [name for name in known if name in names or not names]
    refuse(quick and NAME not in asked, f"--quick makes the first seed of {NAME}, which is not "
           "asked for; leave --quick out")
    make_folder(out)
    rows, lacking, failed = None, list[str](), list[str]()
    with interruptible("the same command continues from here", out):
        for found in _made(asked, out, quick, Workers(workers), failed):
            rows = found or rows
            lacking = [] if quick else pages.fill(pages.ROOT, Stored.read(pages.ROOT))[1]
    if rows is not None:
        _report(rows, as_json)
    tell(f"{_minutes(begun)} in all")
    refuse(lacking, "; ".join(lacking))
    return int(bool(failed))


def _made(asked: Sequence[str], out: Path, quick: bool, workers: Workers, failed: list[str]
          ) -> Iterator[Rows | None]:
    """Make and store rows, fronts with their figure, and outputs; yield after each, rows if any.

    Commands that end with an error are added to `failed`.
    """
    root = pages.ROOT
    with bar("runs") as progress:
        for rows in protocol.run(replace(PROTOCOL, seeds=PROTOCOL.seeds[:1]) if quick else PROTOCOL,
                                 out / NAME, workers, progress) if NAME in asked else ():
            if not quick:
                protocol.write(rows, root / ROWS)
            yield rows
        if quick:
            return
        if TUNED in asked:
            points = fronts.run(out / TUNED, workers, progress)
            write_json(root / POINTS, [asdict(one) for one in points])
            fronts.figure(points).savefig(root / "docs/images/fronts.png", dpi=120)
            yield None
    found = dict.fromkeys(command for page in asked if page not in (NAME, TUNED)
                          for command in pages.commands((root / page).read_text(encoding="utf-8")))
    for count, command in enumerate(found, 1):
        tell(f"command {count} of {len(found)}: {command} ...")
        begun = perf_counter()
        try:
            write_text(pages.file_of(command, root), pages.run(command, root, out / "output"))
        except pages.CommandError as error:
            tell(f"left as it is: {error}")
            failed.append(command)
            continue
        tell(f"  {_minutes(begun)}")
        yield None


def _minutes(begun: float) -> str:
    """Return the time since then as minutes and seconds: "41:07 min"."""
    seconds = round(perf_counter() - begun)
    return f"{seconds // 60}:{seconds % 60:02} min"


def _report(rows: Rows, as_json: bool) -> None:
    """Print the claims with what was found and the verdicts."""
    if as_json:
        return print_json([{"claim": one.claim.name, "text": one.claim.text, "p": one.p,
                            "found": said(one, rows), "verdict": one.decided}
                           for one in every(rows)])
    for one in every(rows):
        print(f"{one.decided}: {one.claim.text}\n    {said(one, rows)}")
