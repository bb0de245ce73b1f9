import sys
from pathlib import Path

import numpy as np
import pytest

from hierarchy import HierarchyError
from scenarios.cell.build import build
from scenarios.cli.main import run_command
from scenarios.config import ScenarioError, load, shipped
from scenarios.config.reference import keys_of, sections


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_loads_under_its_own_name_and_reads_back_the_same(name, tmp_path):
    scenario = load(name)
    assert scenario.name == name
    assert scenario.title
    scenario.make_resolver()
    (tmp_path / "scenario.toml").write_text(scenario.to_toml())
    assert load(tmp_path / "scenario.toml") == scenario


def test_a_variant_has_two_names_and_those_of_a_file_extend_it(tmp_path):
    assert load("ellipse:35deg") == load("ellipse-35deg")
    (tmp_path / "mine.toml").write_text('extends = "ellipse:limits"\nname = "mine"\n'
                                        "[variants.wide.pointing]\nalpha_d = 50.0\n")
    assert load(f"{tmp_path}/mine.toml").pointing.alpha_d == 5.0
    wide = load(f"{tmp_path}/mine.toml:wide")
    assert (wide.name, wide.pointing.alpha_d) == ("mine-wide", 50.0)
    assert wide.limits == load("ellipse-limits").limits
    with pytest.raises(HierarchyError, match="wide"):
        load(f"{tmp_path}/mine.toml:wid")


def test_changes_are_toml_values_at_dotted_keys():
    s = load("ellipse", ["pointing.alpha_d=35", "pointing.kind=equality",
                         "avoidance.obstacles=[[1, 2, 3]]", "control.options.damping = 0.02"])
    assert (s.pointing.alpha_d, s.pointing.rows) == (35.0, "equality")
    assert s.avoidance.obstacles[0].centre == (1, 2, 3)
    assert s.control.settings() == {"damping": 0.02, "threshold": 0.1}
    assert load("ellipse", {"pointing.alpha_d": 35}).pointing.alpha_d == 35


def test_a_resolver_is_swapped_by_name_keeping_the_shared_settings():
    s = load("ellipse").with_resolver("recursive")
    assert s.control.resolver == "recursive"
    assert s.control.settings() == {"damping": 0.05, "threshold": 0.1}
    assert load("ellipse", ["control.resolver=recursive"]) == s, "changing its name is enough"
    assert s.with_resolver("tpm-published") == load("ellipse")
    assert load("ellipse").with_resolver("tpm:damping=0.01").control.settings() == {
        "damping": 0.01, "threshold": 0.1}


def test_a_stack_that_asks_for_nothing_is_refused(tmp_path):
    path = tmp_path / "idle.toml"
    path.write_text('name = "idle"\n[robot]\nmodel = "kuka_lwr"\n'
                    '[control]\nresolver = "tpm"\nduration = 1.0\n')
    with pytest.raises(ScenarioError, match="scenario 'idle': the stack is empty"):
        build(load(path))


def test_waypoints_of_obstacles_vary_within_their_spread_and_half_the_time_beside_them():
    def paths(seed, spread, timing):
        change = f"avoidance.variation={{seed={seed}, spread={spread}, timing={timing}}}"
        return [(np.array(one.path.times), np.array(one.path.points))
                for one in load("human", [change]).avoidance.placed]

    away = []
    for seed in range(20):
        for (t, p), (times, points) in zip(paths(0, 0.0, 0.0), paths(seed, 0.1, 0.9), strict=True):
            away += np.linalg.norm(points - p, axis=1).tolist()
            room = np.append(np.minimum(np.diff(t)[:-1], np.diff(t)[1:]), np.diff(t)[-1]) / 2.0
            assert (np.abs(times - t) <= 0.9 * np.r_[0.0, room] + 1e-12).all()
            np.testing.assert_array_equal((points[1:] == points[:-1]).all(axis=1),
                                          (p[1:] == p[:-1]).all(axis=1))  # where it rests
    assert len(np.unique(away)) > 20
    assert max(away) <= 0.1
    assert np.median(away) == pytest.approx(0.1 * 0.5 ** (1.0 / 3.0), rel=0.05)  # of a ball


EXTENSIONS = Path(__file__).parents[2] / "docs" / "_ext"


def test_every_key_has_a_meaning():
    assert not [f"{place} {section.__name__}.{key.name}" for place, section in sections()
                for key in keys_of(section) if not key.meaning]


def test_the_page_of_keys_is_as_the_program_has_them(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(EXTENSIONS), *sys.path])
    import scenario_keys

    assert scenario_keys.written() == scenario_keys.PAGE.read_text(encoding="utf-8"), (
        "run `python docs/_ext/scenario_keys.py`")


@pytest.mark.parametrize(("asked", "said"), [
    ("avoidance.obstacles.path", ["Path of its middle", 'with kind = "waypoints"', "list: 3 × numb"
                                  "er [m], required"]),
    ("tasks.0.gain", ['[[tasks]] with kind = "pose"', "[1/s], default 10.0", "default 5.0"]),
    ("control.period", ["number > 0 ≤ 1 [s], default 0.001", "Time from tick to tick."]),
    ("start.q", ["[rad or m]"]), ("duration", ["control.duration", "faults.duration"]),
    ("run", ["Usage: hierarchy run"]), ("tasks", ["[[tasks]]"])])
def test_help_says_what_a_key_means(asked, said, capsys):
    assert run_command(["help", asked]) == 0
    text = capsys.readouterr().out
    assert all(one in text for one in said)
