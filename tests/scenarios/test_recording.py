"""Signals, what is saved of a run, and what a module of one's own adds."""

import errno
import json
import os
import subprocess
import sys
from unittest import mock

import numpy as np
import pytest
from hand_made import recording
from refusals import refused

from hierarchy.errors import HierarchyError, UnknownNameError
from scenarios import load, load_run, save, simulate
from scenarios.files import OutputError, claim, next_free, whole
from scenarios.measure import run_folder
from scenarios.recording.signals import known


def test_a_run_in_the_home_folder_is_found_where_it_was_saved(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert save(simulate(load("ellipse", ["control.duration=0.003"])), "~/a") == tmp_path / "a"
    assert load_run("~/a").ticks == 3


def test_what_was_saved_is_loaded_again_to_the_last_bit(tmp_path):
    saved = recording(q=np.random.default_rng(0).normal(size=(5, 7)), fault="stopped at tick 5")
    loaded = load_run(save(saved, tmp_path / "run"))
    assert loaded.signals.keys() == saved.signals.keys()
    for name, signal in saved.signals.items():
        np.testing.assert_array_equal(loaded[name], signal)
        assert loaded[name].dtype == signal.dtype
    assert (loaded.orders, loaded.fault) == (saved.orders, saved.fault)
    versions = json.loads((tmp_path / "run" / "versions.json").read_text())
    assert versions["numpy"] == np.__version__
    assert {"python", "pin", "task-hierarchy"} <= versions.keys()


@pytest.mark.parametrize(("told", "said"), [("arm", "arm"), ("", "unknown processor")])
def test_the_processor_is_the_one_that_python_tells_where_the_system_has_no_list(
        told, said, monkeypatch):
    monkeypatch.setattr(run_folder, "Path", mock.Mock(side_effect=FileNotFoundError))
    monkeypatch.setattr(run_folder.platform, "processor", lambda: told)
    assert run_folder.versions()["processor"] == f"{said}, {os.cpu_count()} cores"


def test_a_file_that_is_cut_off_or_has_wrong_bits_is_named(tmp_path):
    refused("no run.npz", load_run, tmp_path)
    save(recording(), tmp_path)
    sound, rng, named = (tmp_path / "run.npz").read_bytes(), np.random.default_rng(1), 0
    for trial in range(150):
        damaged = bytearray(sound)[:rng.integers(len(sound)) if trial < 50 else None]
        for at in rng.integers(len(damaged), size=3) if len(damaged) else ():
            damaged[at] ^= 1 << int(rng.integers(8))
        (tmp_path / "run.npz").write_bytes(damaged)
        try:
            load_run(tmp_path)
        except HierarchyError as error:
            named += "run.npz" in str(error)
    assert named > 100


@pytest.mark.parametrize(("change", "said"), [
    ({"q": np.zeros((5, 6))}, "signal 'q': float64 of shape (5, 6), expected numbers of shape"),
    ({"v": np.zeros((4, 7))}, "signal 'v': float64 of shape (4, 7)"),
    ({"t": np.array(["a"] * 5)}, "signal 't': <U1 of shape (5,)"),
    ({"order": np.full(5, 2)}, "signal 'order': no index into orders"),
    ({"status": np.full(5, 77)}, "signal 'status': no Status"),
    ({"events": np.array([(5, "late", "brake")], run_folder._EVENT)}, "an event of no tick")])
def test_a_signal_of_another_shape_or_meaning_is_named(tmp_path, change, said):
    save(recording(), tmp_path)
    with np.load(tmp_path / "run.npz") as arrays:
        np.savez(tmp_path / "run.npz", **{**arrays, **change})
    refused(f"{tmp_path} cannot be read: {said}", load_run, tmp_path)


def write(folder, error=None):
    with whole(claim(folder)) as partial:
        (partial / "file").touch()
        assert not folder.exists()
        if error:
            raise error


def test_what_is_written_is_there_as_a_whole_or_not_at_all(tmp_path):
    with pytest.raises(OutputError, match=r"run cannot be written: No space left"):
        write(tmp_path / "run", OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "run", KeyboardInterrupt())
    assert list(tmp_path.iterdir()) == []
    write(next_free(tmp_path / "run"))
    (tmp_path / "run-3").mkdir()  # with the usual permissions
    assert {path.name for path in tmp_path.iterdir()} == {"run", "run-3"}
    assert (tmp_path / "run").stat().st_mode == (tmp_path / "run-3").stat().st_mode
    assert next_free(tmp_path / "run") == tmp_path / "run-2"


def test_a_folder_that_another_process_has_locked_cannot_be_claimed(tmp_path):
    code = ("import sys; from pathlib import Path; from scenarios.files import lock\n"
            "lock(Path(sys.argv[1])); print(flush=True); sys.stdin.read()")
    with subprocess.Popen([sys.executable, "-c", code, str(tmp_path / "run")],
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        other.stdout.readline()
        refused("run is going to be written by", claim, tmp_path / "run", error=OutputError)
        assert next_free(tmp_path / "run") == tmp_path / "run-2"
        other.stdin.close()
    assert claim(tmp_path / "run") == tmp_path / "run"


@pytest.fixture(scope="module")
def run():
    return simulate(load("dual-arm", ["control.duration=0.01"]))


def test_a_signal_that_a_run_lacks_is_absent_and_a_misspelt_one_an_error_with_the_nearest(run):
    assert "minimal_distance" not in run
    assert run.get("minimal_distance", np.zeros(1)).shape == (1,)
    for ask in (lambda: "minimal_distnce" in run, lambda: run["minimal_distnce"],
                lambda: run.get("minimal_distnce", np.zeros(0))):
        refused("minimal_distance", ask, error=UnknownNameError)
    for name, values in run.signals.items():
        assert known(name).shape.strip("(,)").count(",") + 1 == values.ndim, name
