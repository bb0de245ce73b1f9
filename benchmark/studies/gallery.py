"""A small picture and the main numbers of every shipped scenario, for docs/gallery.md.

`python -m benchmark.studies.gallery` runs all scenarios, `... gallery NAME NAME` only those.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
from PIL import Image

from scenarios.config import load, shipped
from scenarios.draw.figures import drawing
from scenarios.draw.figures.picture import picture
from scenarios.files import write_bytes
from scenarios.loop.simulation import simulate
from scenarios.measure.metrics import measure

if TYPE_CHECKING:
    from scenarios.recording.recording import Recording

FOLDER = Path("docs/images/gallery")  # from the root of the repository

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
    asked = parser.parse_args(arguments)
    asked.out.mkdir(parents=True, exist_ok=True)
    for name in asked.scenarios:
        recording = simulate(load(name))
        write_bytes(asked.out / f"{name}.png", small_png(recording))
        print(f"{name}: {'; '.join(main_numbers(recording))}", flush=True)


def small_png(recording: Recording) -> bytes:
    """Return the picture of a run as a PNG with a reduced palette."""
    drawn, reduced = io.BytesIO(), io.BytesIO()
    with matplotlib.rc_context(drawing.style()):
        picture({recording.scenario.name: recording}).savefig(
            drawn, format="png", dpi=_DPI, facecolor="white")
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(_COLOURS).save(reduced, format="png", optimize=True)
    return reduced.getvalue()


def main_numbers(recording: Recording) -> list[str]:
    """Return the most important metrics of a run, as text with units."""
    return [f"{metric.label} {metric.shown()} {metric.shown_unit}".strip()
            for name, metric in measure(recording).items() if metric.value is not None
            and (name in _NUMBERS or (name.startswith("task_") and name.endswith(_OF_TASKS)))]


if __name__ == "__main__":
    main()
