"""A small picture of every shipped scenario, for docs/gallery.md.

`python -m benchmark.studies.gallery` runs all scenarios, `... gallery NAME NAME` only those;
`--documents` draws the pictures of runs in the other documents.
"""

import io
import tempfile
from pathlib import Path
from typing import Annotated

import matplotlib
import typer
from PIL import Image

from scenarios.config import load, shipped
from scenarios.draw.figures import drawing
from scenarios.draw.figures.letter import write_all
from scenarios.draw.figures.picture import picture
from scenarios.files import make_folder, write_bytes
from scenarios.loop.simulation import uninterrupted

FOLDER = Path("docs/images/gallery")  # from the root of the repository
DOCUMENTS = {
    "ellipse": {"picture": "ellipse", "figure-4b-joint-velocities": "speeds-ellipse"},
    "ellipse-hqp": {"joint-velocities": "speeds-ellipse-hqp"},
    "human": {"figure-8-depth-image": "human-depth",
              "figure-10-errors-and-distances": "human-errors"}}
"""For each scenario the pictures in `docs/images`, by the figure that they are."""

_COLOURS = 255  # of the palette: enough for flat drawings, and half the bytes


def main(scenarios: Annotated[list[str] | None, typer.Argument()] = None, out: Path = FOLDER,
         documents: bool = False) -> None:
    """Run the given scenarios, by default all, and write their pictures."""
    for name in () if documents else scenarios or shipped():
        recording, drawn = uninterrupted(load(name)), io.BytesIO()
        with matplotlib.rc_context(drawing.present().settings):
            picture({name: recording}).savefig(drawn, format="png", dpi=130, facecolor="white")
        _write(drawn, make_folder(out) / f"{name}.png")
        print(f"{name}.png", flush=True)
    for name, pictures in DOCUMENTS.items() if documents else ():
        with tempfile.TemporaryDirectory() as folder:
            write_all([uninterrupted(load(name))], Path(folder))
            for stem, image in pictures.items():
                _write(Path(folder, f"{stem}.png"), FOLDER.parent / f"{image}.png")
                print(f"{name}: {image}.png", flush=True)


def _write(drawn: io.BytesIO | Path, path: Path) -> None:
    """Write a picture as a PNG with a reduced palette."""
    small = io.BytesIO()
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(_COLOURS).save(small, format="png", optimize=True)
    write_bytes(path, small.getvalue())


if __name__ == "__main__":
    typer.run(main)
