"""A small picture and the main numbers of every shipped scenario, for docs/gallery.md.

`python -m benchmark.studies.gallery` runs all scenarios, `... gallery NAME NAME` only those;
`--documents` draws the pictures of runs in the other documents.
"""

from __future__ import annotations

import argparse
import io
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
from PIL import Image

from scenarios.config import load, shipped
from scenarios.draw.figures import drawing
from scenarios.draw.figures.letter import write_all
from scenarios.draw.figures.picture import picture
from scenarios.files import write_bytes
from scenarios.loop.simulation import simulate
from scenarios.measure.metrics import measure

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording

FOLDER = Path("docs/images/gallery")  # from the root of the repository
DOCUMENTS = {
    "ellipse": {"picture": "ellipse", "figure-4b-joint-velocities": "speeds-ellipse"},
    "ellipse-hqp": {"joint-velocities": "speeds-ellipse-hqp"},
    "human": {"figure-8-depth-image": "human-depth",
              "figure-10-errors-and-distances": "human-errors"}}
"""For each scenario the pictures in `docs/images`, by the figure that they are."""

_DPI = 130
_COLOURS = 255  # of the palette: enough for flat drawings, and half the bytes
_NUMBERS = ("position_error_rms_settled", "cone_violation_max", "body_distance_min",
            "ee_distance_min", "joint_limit_excess", "speed_max", "acceleration_max",
            "stack_changes", "ticks_not_solved")
_OF_TASKS = "_max_settled"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the given scenarios, by default all, and write their pictures."""
    parser = argparse.ArgumentParser(prog="python -m benchmark.studies.gallery",
                                     description=__doc__)
    parser.add_argument("scenarios", nargs="*", default=shipped(), metavar="scenario")
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="FOLDER")
    parser.add_argument("--documents", action="store_true")
    asked = parser.parse_args(arguments)
    if asked.documents:
        return _draw_documents()
    asked.out.mkdir(parents=True, exist_ok=True)
    for name in asked.scenarios:
        recording = simulate(load(name))
        write_bytes(asked.out / f"{name}.png", small_png(recording))
        print(f"{name}: {'; '.join(main_numbers(recording))}", flush=True)


def _draw_documents() -> None:
    for name, pictures in DOCUMENTS.items():
        with tempfile.TemporaryDirectory() as folder:
            write_all([simulate(load(name))], Path(folder))
            for stem, image in pictures.items():
                write_bytes(FOLDER.parent / f"{image}.png", reduced(Path(folder, f"{stem}.png")))
                print(f"{name}: {image}.png", flush=True)


def small_png(recording: Recording) -> bytes:
    """Return the picture of a run as a PNG with a reduced palette."""
    drawn = io.BytesIO()
    with matplotlib.rc_context(drawing.style()):
        picture({recording.scenario.name: recording}).savefig(
            drawn, format="png", dpi=_DPI, facecolor="white")
    return reduced(drawn)


def reduced(drawn: io.BytesIO | Path) -> bytes:
    """Return a picture as a PNG with a reduced palette."""
    small = io.BytesIO()
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(_COLOURS).save(small, format="png", optimize=True)
    return small.getvalue()


def main_numbers(recording: Recording) -> list[str]:
    """Return the most important metrics of a run, as text with units."""
    return [f"{metric.label} {metric.shown()} {metric.shown_unit}".strip()
            for name, metric in measure(recording).items() if metric.value is not None
            and (name in _NUMBERS or (name.startswith("task_") and name.endswith(_OF_TASKS)))]


if __name__ == "__main__":
    main()
