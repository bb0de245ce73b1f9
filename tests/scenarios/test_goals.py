"""Goals and numbers of a run, what samples tell, and why an answer jumps."""


import numpy as np
import pytest
from scipy.stats import PermutationMethod, wilcoxon

from scenarios import load, simulate
from scenarios.measure.goals import goals
from scenarios.measure.metrics import measure
from scenarios.measure.statistics import EXACT, paired


@pytest.mark.parametrize("seed", range(5))
def test_the_p_value_is_that_of_all_signs_with_and_without_ties(seed):
    random = np.random.default_rng(seed)
    first = random.normal(size=9)
    second = first + 0.4 + random.normal(size=9)
    assert paired(first, second).p == pytest.approx(wilcoxon(second - first, method="exact")[1])
    second = np.random.default_rng(seed).integers(-2, 5, 11).astype(float)
    assert paired(np.zeros(11), second).p == pytest.approx(wilcoxon(
        second[second != 0.0], method=PermutationMethod(n_resamples=np.inf))[1])
    for count, method in ((EXACT, "exact"), (EXACT + 1, "asymptotic")):
        apart = 0.2 + random.normal(size=count)
        assert paired(np.zeros(count), apart).p == pytest.approx(wilcoxon(apart, method=method)[1])
        counts = random.integers(50, 900, count) + random.integers(0, 5, (2, count))
        assert paired(*counts / 1257.0).p == paired(*counts * 8.0).p  # shares tie to rounding


def test_tasks_are_judged_by_where_the_robot_truly_is_wherever_a_file_lists_them():
    own = load("ellipse", {"avoidance": None, "pointing.alpha_d": 5.0, "control.duration": 0.2,
                           "control.stack": "hierarchical", "control.resolver": "hcod",
                           "plant.measurement": {"position_noise": 0.003}})
    sections = own.model_dump(mode="json")
    position, pointing = (
        {**{key: sections[name][key] for key in ("stiffness", "damping", *more)},
         "kind": name, "frame": "end_effector"}
        for name, more in (("position", ["path"]), ("pointing", ["axis", "alpha_d"])))
    listed = own.with_changes({"position": None, "pointing": None, "tasks": [position, pointing]})
    runs = [simulate(one) for one in (own, listed)]
    np.testing.assert_array_equal(runs[0]["q"], runs[1]["q"])
    apart = np.abs(runs[0]["true_pointing_error"] - runs[0]["pointing_error"]).max()
    assert 1e-4 < apart < 0.1
    assert goals(runs[0])[:2] == goals(runs[1])[:2]
    path, task = (measure(run) for run in runs)
    assert path["position_error_rms"].value == pytest.approx(task["task_position_rms"].value)


def test_a_floating_base_is_no_joint():
    run = simulate(load("humanoid", ["control.duration=0.05"]))
    slow = measure(run)
    for name in ("v", "a", "command"):
        run.signals[name][1, :6] = 99.0
    fast = measure(run)
    for name in ("speed_max", "velocity_step_max", "command_step_max", "acceleration_max",
                 "acceleration_step_ticks"):
        assert fast[name].value == slow[name].value
