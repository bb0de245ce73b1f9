import os
import sys

import numpy as np
import pytest

from hierarchy import HierarchyError
from scenarios import load, save, simulate
from scenarios.cli.main import run_command
from scenarios.draw.replay.frames import Frames
from scenarios.draw.replay.video import write_video
from scenarios.scene import scene

pytestmark = pytest.mark.slow


@pytest.fixture
def fake_ffmpeg(tmp_path, monkeypatch):
    """An ffmpeg that writes how it was called and how many bytes it got."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program = folder / "ffmpeg"
    program.write_text(f"""#!{sys.executable}
import pathlib, sys
if "bad" in sys.argv[-1]:
    sys.exit("Unknown encoder")
size = len(sys.stdin.buffer.read())
pathlib.Path(sys.argv[-1]).write_text(" ".join(sys.argv[1:-1]) + f" | {{size}}")
""")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder), prepend=os.pathsep)


@pytest.fixture(scope="module")
def short():
    return simulate(load("ellipse", ["control.duration=0.2"]))


def test_frames_are_pictures_that_differ_where_the_arm_moves(short):
    frames = Frames(scene(short), "ellipse", "#0072b2", (960, 540))
    first, last = frames.draw(0), frames.draw(len(frames) - 1)
    assert first.shape == (540, 960, 3)
    assert first.dtype == np.uint8
    assert (first[:, :540] != last[:, :540]).any()
    assert np.array_equal(first, frames.draw(0))


def test_the_cursor_of_a_frame_is_at_its_time(short):
    frames = Frames(scene(short), "ellipse", "#0072b2", (960, 540))
    first, *others = (frames.draw(f)[200:, 540:] for f in (1, 3, 5))
    changed = [np.flatnonzero((first != other).any(axis=(0, 2))) for other in others]
    assert [len(columns) for columns in changed] == [2, 2]  # where it was, and where it is
    was, middle, last = changed[0][0], changed[0][1], changed[1][1]
    assert changed[1][0] == was
    assert middle - was == pytest.approx(last - middle, abs=1)


@pytest.mark.parametrize("name", ["ellipse-hqp", "ellipse-velocity"])
def test_frames_of_other_scenarios_can_be_drawn(name):
    shown = scene(simulate(load(name, ["control.duration=0.1"])))
    assert len(list(Frames(shown, name, "#d55e00"))) == len(shown.t)


def test_a_video_is_all_frames_and_takes_its_name_when_it_is_whole(short, fake_ffmpeg, tmp_path):
    file = tmp_path / "run.mp4"
    write_video(short, file, rate=10.0)
    said, _, size = file.read_text().partition(" | ")
    assert int(size) == len(scene(short, 10.0).t) * 1280 * 720 * 3
    assert "-s 1280x720 -r 10" in said
    assert {path.name for path in tmp_path.iterdir()} == {"bin", "run.mp4"}


def test_an_ffmpeg_that_fails_is_heard_and_leaves_nothing(short, fake_ffmpeg, tmp_path):
    with pytest.raises(HierarchyError, match="Unknown encoder"):
        write_video(short, tmp_path / "bad.mp4")
    assert [path.name for path in tmp_path.iterdir()] == ["bin"]


@pytest.fixture
def folder(short, tmp_path):
    return save(short, tmp_path / "run")


def test_without_ffmpeg_the_command_says_what_to_do(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert run_command(["replay", str(folder), "--video", str(tmp_path / "x.mp4")]) == 2
    said = capsys.readouterr().err
    assert "ffmpeg" in said
    assert "--out" in said
    assert not (tmp_path / "x.mp4").exists()


def test_the_command_writes_a_video(folder, fake_ffmpeg, tmp_path):
    file = tmp_path / "x.mp4"
    assert run_command(["replay", str(folder), "--video", str(file), "--rate", "5"]) == 0
    assert file.is_file()
    assert not (folder / "replay.html").exists()
