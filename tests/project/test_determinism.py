"""The same scenario, seed and versions give the same bytes; times are measured and kept apart."""

import subprocess
import sys

import pytest

from scenarios import load, save, simulate

RUNS = {"ellipse": ["control.duration=0.2"],
        "ellipse-hqp": ["control.duration=0.05"],
        "ellipse-noisy": ["control.duration=0.1", "plant.measurement.position_noise=0.001",
                          "plant.measurement.seed=3"],
        "humanoid": ["control.duration=0.1"],
        "human": ["control.duration=0.1", "sensor.seed=4"]}


def run_of(name, changes=()):
    return simulate(load(name.removesuffix("-noisy"), [*RUNS[name], *changes]))


def bytes_of(run, folder):
    return (save(run, folder) / "run.npz").read_bytes()


@pytest.mark.parametrize("name", RUNS)
def test_the_same_run_is_written_as_the_same_bytes(name, tmp_path):
    if name == "human":
        pytest.importorskip("mujoco")
    first, second = (bytes_of(run_of(name), tmp_path / folder) for folder in "ab")
    assert first == second


def test_another_process_writes_the_same_bytes(tmp_path):
    mine = bytes_of(run_of("ellipse"), tmp_path / "mine")
    code = ("import sys; from scenarios import load, save, simulate; "
            "save(simulate(load('ellipse', [sys.argv[2]])), sys.argv[1])")
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "other"), *RUNS["ellipse"]],
                   check=True)
    assert (tmp_path / "other" / "run.npz").read_bytes() == mine
