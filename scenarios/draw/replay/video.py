"""A run as a video: frames piped into ffmpeg."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from hierarchy.errors import HierarchyError
from scenarios.files import named, written

if TYPE_CHECKING:
    from scenarios.draw.replay.frames import Frames
    from scenarios.recording.recording import Recording


def write_video(recording: Recording, path: Path, *, rate: float = 30.0,
                progress: Callable[[int, int], None] | None = None) -> None:
    """Write a run as a video of `rate` frames per second, in the format of the suffix of `path`.

    Raises HierarchyError if ffmpeg is missing or fails, and then leaves no file.
    """
    program = shutil.which("ffmpeg")
    if program is None:
        raise HierarchyError("a video needs the program ffmpeg, which is not on the path: install "
                             "it, or write --out FILE.html, which plays in a browser")
    from scenarios.draw.figures.palette import colour
    from scenarios.draw.replay.frames import Frames
    from scenarios.scene import scene

    label = recording.facts.resolver.label
    frames = Frames(scene(recording, rate), f"{recording.scenario.name}, {label}", colour(label))
    path.parent.mkdir(parents=True, exist_ok=True)
    with named(path), written(path) as partial:
        _encode(program, frames, partial, rate, progress)


def _encode(program: str, frames: Frames, path: Path, rate: float,
            progress: Callable[[int, int], None] | None) -> None:
    width, height = frames.size
    command = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgb24",
               "-s", f"{width}x{height}", "-r", f"{rate:g}", "-i", "-", "-an",
               "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-fflags", "+bitexact", str(path)]
    with (tempfile.TemporaryFile() as said,
          subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL,
                           stderr=said) as process):
        assert process.stdin is not None
        try:
            for done, frame in enumerate(frames, 1):
                process.stdin.write(frame.tobytes())
                if progress is not None:
                    progress(done, len(frames))
            process.stdin.close()
        except BrokenPipeError:
            pass  # ffmpeg ended early and says why
        except BaseException:
            process.kill()
            raise
        if process.wait() != 0:
            said.seek(0)
            text = said.read().decode(errors="replace").strip().splitlines()
            raise HierarchyError(f"ffmpeg ended with {process.returncode}: "
                                 f"{text[-1] if text else 'no message'}")
