"""Pictures of runs in the documents, drawn again: python -m benchmark.studies.pictures.

The gallery has a command of its own, `python -m benchmark.studies.gallery`.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from PIL import Image

from scenarios import load, simulate
from scenarios.draw.figures.letter import write_all

IMAGES = Path(__file__).parents[2] / "docs" / "images"
PICTURES = {
    "ellipse": {"picture": "ellipse", "figure-4b-joint-velocities": "speeds-ellipse"},
    "ellipse-hqp": {"joint-velocities": "speeds-ellipse-hqp"},
    "human": {"figure-8-depth-image": "human-depth",
              "figure-10-errors-and-distances": "human-errors"}}


def main() -> None:
    """Run each scenario and copy its figures into the documents."""
    for name, pictures in PICTURES.items():
        with tempfile.TemporaryDirectory() as folder:
            write_all([simulate(load(name))], Path(folder))
            for stem, image in pictures.items():
                with Image.open(Path(folder, f"{stem}.png")) as drawn:
                    drawn.convert("RGB").quantize(255).save(IMAGES / f"{image}.png", optimize=True)
                print(f"{name}: {image}.png", flush=True)


if __name__ == "__main__":
    main()
