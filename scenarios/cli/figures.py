"""`hierarchy figures`: draw a run's figures again from its folder."""

from __future__ import annotations

from pathlib import Path

from scenarios.files import added_to, claim, named, whole


def redraw(run: str | Path, style: str = "screen", out: str | Path | None = None) -> list[Path]:
    """Draw the figures of a run folder in a style, and return the files.

    They replace those in the run folder, or go to `out`, which must be new or empty.

    Raises
    ------
    HierarchyError : `run` is not a run folder or is damaged, `style` is not in drawing.STYLES, or
        the folder cannot be written.
    """
    from hierarchy.errors import UnknownNameError
    from scenarios.draw.figures import drawing, letter
    from scenarios.loop.recording import load_run

    if style not in drawing.STYLES:
        raise UnknownNameError("style", style, drawing.STYLES)
    claimed = None if out is None else claim(out)
    recording = load_run(run)
    writing = added_to(Path(run)) if claimed is None else whole(claimed)
    with drawing.styled(drawing.STYLES[style]), named(claimed or run), writing as partial:
        letter.write_all(recording, partial)
        names = sorted(file.name for file in partial.iterdir())
    return [(claimed or Path(run)) / name for name in names]
