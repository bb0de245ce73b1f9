"""`hierarchy reproduce`: make the numbers of the documents, and write them into the pages."""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

from scenarios.cli.options import INTERRUPTED
from scenarios.cli.progress import bar
from scenarios.cli.terminal import print_json, shown
from scenarios.reproduce import rows
from scenarios.reproduce.blocks import CLAIMS
from scenarios.reproduce.pages import checkout
from scenarios.reproduce.rows import Rows
from scenarios.reproduce.whole import chosen, outputs, reproduce, write_documents
from scenarios.sweep.engine import EngineError
from scenarios.sweep.store import FullError


def reproduce_command(names: list[str], out: Path, quick: bool, workers: int | None,
                      as_json: bool = False) -> int:
    """Run studies and commands; unless `quick`, write the pages; print what the claims came to."""
    asked, begun = chosen(names), perf_counter()
    root = None if quick else checkout()
    try:
        with bar("runs") as progress:
            found = reproduce(asked.studies, out, quick, workers, progress, lambda study: _say(
                f"{study.name}: {study.title}, {len(study.columns)} columns"))
        printed = outputs(asked.pages, root, out / "output", _say) if root else {}
    except (FullError, EngineError) as error:
        _say(f"hierarchy: fault: {error}")
        return 1
    except KeyboardInterrupt:
        _say("hierarchy: interrupted; the same command continues from here")
        return INTERRUPTED
    written = [rows.write(one, out) for one in found.values()]
    if root:
        written += write_documents(found, printed, root)
    _report(found, written, as_json)
    _say(f"{perf_counter() - begun:.0f} s")
    return 0


def fill_command() -> int:
    """Write the pages of the checkout from the rows and outputs that are kept."""
    print(*map(shown, write_documents({}, {}, checkout())), sep="\n")
    return 0


def _report(found: dict[str, Rows], written: list[Path], as_json: bool) -> None:
    """Print the claims with their verdicts, and the files."""
    files = [shown(path) for path in written]
    judged = [(claim, claim.judge(found[claim.study])) for claim in CLAIMS if claim.study in found]
    if as_json:
        print_json({"files": files, "claims": [
            {"text": claim.text, "study": claim.study, "found": one.found, "verdict": one.verdict}
            for claim, one in judged]})
        return
    for claim, one in judged:
        print(f"{one.verdict:>20}  {claim.text}\n{'':22}{one.found}")
    print("", *files, sep="\n")


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
