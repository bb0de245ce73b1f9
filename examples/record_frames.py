"""Write the depth images of a scenario's camera to a folder.

python examples/record_frames.py SCENARIO FOLDER [KEY=VALUE ...]
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from scenarios.cell.build import build
from scenarios.cell.sensors.camera import ABOUT, INTRINSICS, DepthCamera
from scenarios.config import load
from scenarios.loop.simulation import simulate
from scenarios.recording.recording import Recording
from task_hierarchy import HierarchyError

_MILLIMETRE = 1e-3


def write(folder: str | Path, recording: Recording, frames: int | None = None) -> Path:
    """Write the camera images of a run, at most the first `frames`, to a new folder.

    The run must have sensor.kind = "camera". Depths are rounded to millimetres.
    """
    from PIL import Image as Png

    cell = build(recording.scenario)
    camera = getattr(cell.sensor, "source", None)
    if not isinstance(camera, DepthCamera):
        raise HierarchyError(f"scenario {recording.scenario.name!r} has no camera")
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=False)
    entries: list[dict[str, Any]] = []
    seen = recording["true_q" if "true_q" in recording else "q"]
    for k, t in enumerate(recording["t"]):
        frame = camera.newest(float(t))
        if frame < 0 or (k > 0 and frame == camera.newest(float(recording["t"][k - 1]))):
            continue
        if len(entries) == frames:
            break
        cell.state.move(float(t), recording["q"][k], recording["v"][k])
        camera.joints = partial(seen.__getitem__, k)
        reading, _ = camera.image(frame, cell.state)
        name = f"{len(entries):04d}.png"
        steps = np.rint(np.minimum(reading / _MILLIMETRE, 65535.0)).astype(np.uint16)
        Png.fromarray(steps).save(folder / name, optimize=True)
        entries.append({"file": name, "time": float(t), "q": recording["q"][k].tolist()})
    about = {key: _plain(getattr(camera.pinhole, key)) for key in INTRINSICS}
    text = tomli_w.dumps({**about, "scale": _MILLIMETRE, "frame": entries})
    (folder / ABOUT).write_text(text, encoding="utf-8")
    return folder


def _plain(value: Any) -> Any:
    return np.asarray(value, dtype=float).tolist() if np.ndim(value) else value


def main(arguments: Sequence[str]) -> int:
    """Run the command described in the module's docstring."""
    if len(arguments) < 2:
        print(__doc__, file=sys.stderr)
        return 2
    try:
        run = simulate(load(arguments[0], ["sensor.kind=camera", *arguments[2:]]))
        print(write(arguments[1], run))
    except (HierarchyError, FileExistsError) as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
