"""`hierarchy reproduce`: run the studies behind the documents, and write their numbers."""

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
from scenarios.reproduce.whole import chosen, reproduce, write_documents
from scenarios.sweep.engine import EngineError
from scenarios.sweep.store import FullError


def reproduce_command(names: list[str], out: Path, quick: bool, workers: int | None,
                      as_json: bool = False) -> int:
    """Run studies; with all samples write rows and pages of the checkout; print the claims."""
    studies, begun = chosen(names), perf_counter()
    root = None if quick else checkout()
    try:
        with bar("runs") as progress:
            found = reproduce(studies, out, quick, workers, progress, lambda study: print(
                f"{study.name}: {study.title}, {len(study.columns)} columns", file=sys.stderr))
    except (FullError, EngineError) as error:
        print(f"hierarchy: fault: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("hierarchy: interrupted; the same command continues from here", file=sys.stderr)
        return INTERRUPTED
    judged = [(claim, claim.judge(found[claim.study])) for claim in CLAIMS if claim.study in found]
    written = [shown(rows.write(one, out)) for one in found.values()]
    if root is not None:
        written += [shown(path) for path in write_documents(found, root)]
    if as_json:
        print_json({"files": written, "claims": [
            {"text": claim.text, "study": claim.study, "found": one.found, "verdict": one.verdict}
            for claim, one in judged]})
        return 0
    for claim, one in judged:
        print(f"{one.verdict:>20}  {claim.text}\n{'':22}{one.found}")
    print("", *written, sep="\n")
    print(f"\n{perf_counter() - begun:.0f} s")
    return 0
