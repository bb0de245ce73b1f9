"""Every kind of `[[tasks]]` in a scenario: what it is made of, and what it reaches."""

import numpy as np
import pytest
import tomli_w
from refusals import refused

from hierarchy.tasks import Separation
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.measure.metrics import measure

BASE = {"name": "listed", "robot": {"model": "kuka_lwr"},
        "start": {"q": [0.9, -0.9, 0.9, 1.2, 1.0, 1.0, 0.3]},
        "control": {"level": "velocity", "stack": "hierarchical", "period": 0.01,
                    "duration": 1.5, "resolver": "hcod"}, "damping": {"value": 1.0}}
COUPLING = {"kind": "coupling", "joints": {"joint_2": 1.0, "joint_5": -0.5}, "value": -1.0}
HAND = {"kind": "position", "frame": "end_effector"}
LOOK = {"kind": "look-at", "frame": "end_effector", "target": [0.3, 0.9, 0.9]}
FRAME = {"kind": "frame", "frame": "end_effector", "offset": [0.03, 0.05, 0.02],
         "rotation": [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]}
RELATIVE = {"kind": "relative", "frame": "end_effector", "to": "joint_3",
            "position": [0.405, -0.065, 0.521]}


def scenario_of(tmp_path, *tasks, **sections):
    """A scenario with these tasks, read from a file as a user's is."""
    file = tmp_path / "listed.toml"
    file.write_text(tomli_w.dumps({**BASE, **sections, "tasks": list(tasks)}))
    return load(file)


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
@pytest.mark.parametrize(("task", "metric"), [
    (COUPLING, "task_coupling_end"), (FRAME, "task_frame_end"), (LOOK, "task_look-at_end"),
    ({**RELATIVE, "orientation": False}, "task_relative_end"),
    (RELATIVE | {"position": None, "name": "hold"}, "task_hold_end")])
def test_a_task_reaches_its_target_at_both_levels(task, metric, level, tmp_path):
    task = {key: value for key, value in task.items() if value is not None}
    control = {**BASE["control"], "level": level, "period": 0.005, "duration": 3.0}
    run = simulate(scenario_of(tmp_path, task, control=control))
    assert run.fault is None
    assert measure(run)[metric].value < (0.1 if "look" in metric else 1e-3)  # deg, or m and rad


def test_collision_says_where_in_the_list_the_obstacles_come(tmp_path):
    avoidance = {"kind": "separation", "distance": 0.05, "obstacles": [[0.1, 0.5, 0.1]]}
    first = build(scenario_of(tmp_path, HAND, avoidance=avoidance))
    assert first.stack.names == ("separation", "position")
    listed = {"kind": "collision", "give": 0.01}
    later = build(scenario_of(tmp_path, HAND, listed, COUPLING, avoidance=avoidance))
    assert later.stack.names == ("position", "separation", "coupling")
    assert isinstance(later.stack["separation"], Separation)
    assert later.tasks.give == {"separation": 0.01}
    refused("tasks.0: name = 'hands'", scenario_of, tmp_path, {**listed, "name": "hands"},
            avoidance=avoidance)


def test_a_recorded_path_is_followed(tmp_path):
    (tmp_path / "motion.csv").write_text("t,x,y,z\n0,0,0.6,0.1\n0.7,0.1,0.6,0.15\n"
                                         "1.2,0.1,0.6,0.2\n")
    path = {"kind": "recorded", "file": "motion.csv"}
    run = simulate(scenario_of(tmp_path, position={"path": path, "gain": 20.0}))
    assert run.fault is None
    # What is left is what integrating velocities over a period leaves: v T / 2 and less.
    assert np.linalg.norm(run["position_error"][-30:], axis=1).max() < 2e-3
