"""The command `hierarchy figures`: a run's figures anew, from its folder alone."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from scenarios.files import OutputError, claim, whole


def redraw(run: str | Path, style: str = "screen", out: str | Path | None = None) -> list[Path]:
    """Draw the figures of a run folder in a style, and return the files.

    They take the place of those in the run folder, or go to `out`, which must be new or empty.

    Raises
    ------
    HierarchyError : `run` is not a run folder or is damaged, `style` is none of drawing.STYLES, or
        the folder cannot be written.
    """
    from hierarchy.errors import UnknownNameError
    from scenarios.draw.figures import drawing, letter
    from scenarios.loop.recording import load_run

    if style not in drawing.STYLES:
        raise UnknownNameError("style", style, drawing.STYLES)
    folder = None if out is None else claim(out)
    recording = load_run(run)
    with drawing.styled(drawing.STYLES[style]):
        if folder is None:
            return _into(Path(run), lambda partial: letter.write_all(recording, partial))
        with whole(folder) as partial:
            letter.write_all(recording, partial)
        return sorted(folder.iterdir())


def _into(folder: Path, write: Callable[[Path], None]) -> list[Path]:
    """Move files one by one into a folder that has others, once all of them are written."""
    try:
        with tempfile.TemporaryDirectory(prefix=".figures.", dir=folder) as partial:
            write(Path(partial))
            return [file.replace(folder / file.name) for file in sorted(Path(partial).iterdir())]
    except OSError as error:
        raise OutputError(f"{folder} cannot be written: {error.strerror}") from error
