"""`hierarchy figures`: draw the figures of runs again from their folders."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scenarios.files import added_to, claim, named, whole


def redraw(runs: Sequence[str | Path], style: str = "screen",
           out: str | Path | None = None) -> list[Path]:
    """Draw the figures of run folders in a style, and return the files.

    Those of one run replace the figures in its folder, or go to `out`, which must be new or empty.
    Several runs are drawn together, see `letter.write_together`, and need `out`.

    Raises
    ------
    HierarchyError : one of `runs` is not a run folder or is damaged, `style` is not in
        drawing.STYLES, `out` is missing or cannot be written, or there is nothing to draw.
    """
    from hierarchy.errors import HierarchyError, UnknownNameError
    from scenarios.draw.figures import drawing, letter
    from scenarios.measure.run_folder import load_run

    if style not in drawing.STYLES:
        raise UnknownNameError("style", style, drawing.STYLES)
    if len(runs) > 1 and out is None:
        raise HierarchyError(f"figures of {len(runs)} runs belong to no run's folder: give --out")
    claimed = None if out is None else claim(out)
    recordings = [load_run(run) for run in runs]
    writing = added_to(Path(runs[0])) if claimed is None else whole(claimed)
    with drawing.styled(drawing.STYLES[style]), named(claimed or runs[0]), writing as partial:
        if len(recordings) == 1:
            letter.write_all(recordings[0], partial)
        else:
            letter.write_together(recordings, partial)
        names = sorted(file.name for file in partial.iterdir())
    return [(claimed or Path(runs[0])) / name for name in names]
