"""The examples run, and print what they promise: strict levels beside how it is done otherwise."""

from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

from hierarchy import State
from scenarios import load, simulate
from scenarios.cell.build import build

EXAMPLES = Path(__file__).parents[2] / "examples"
# Seconds of the run; at most this with strict levels, and at least that otherwise [mm, deg, ...].
PROMISES = {"humanoid": (1.8, 0.6, 2.5), "iiwa": (1.2, 0.3, 0.9), "mobile": (1.2, 0.5, 1.5),
            "panda": (1.2, 0.1, 0.9), "policy": (1.5, 0.6, 100.0), "quadruped": (1.0, 1.0, 1.5),
            "retarget": (0.1, 0.12, 5.0), "so101": (0.8, 0.1, 4.5),
            "teleop": (1.5, 15.001, 100.0), "wall": (1.6, 0.01, 100.0)}


@pytest.mark.parametrize("name", PROMISES)
def test_an_example_keeps_what_it_promises_where_the_other_way_does_not(name, capsys):
    duration, most, least = PROMISES[name]
    strict, other = run_path(str(EXAMPLES / f"{name}.py"))["main"](duration)
    assert strict <= most
    assert other >= least
    assert len(capsys.readouterr().out.splitlines()) == 1


EQUAL = ["control.resolver=weighted", "control.options.ratio=1", "control.damping=0"]


def test_the_ur5_keeps_clear_of_the_ball_and_of_itself_and_with_equal_weights_does_not():
    strict, equal = (simulate(load(EXAMPLES / "ur5.toml", changes)) for changes in ([], EQUAL))
    assert min(strict["minimal_distance"].min(), strict["ee_distance"].min()) > 0.0499
    cell = build(strict.scenario)
    links = [cell.stack["self-separation"].distances(State.at(cell.robot, q)).min()
             for q in strict["q"][::20]]
    assert 0.0349 < min(links) < 0.036  # and it comes so near
    assert equal["ee_distance"].min() < -0.05


def test_two_hands_hold_their_tray_and_with_equal_weights_do_not():
    strict, equal = (simulate(load(EXAMPLES / "tray.toml", ["control.duration=2", *changes]))
                     for changes in ([], EQUAL))
    apart = [np.linalg.norm(run["task_error_grip"][:, :3], axis=1).max() for run in (strict, equal)]
    assert apart[0] < 0.002
    assert apart[1] > 0.05
