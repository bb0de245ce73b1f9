import json

import numpy as np
import pytest

from hierarchy.errors import HierarchyError
from scenarios import load, shipped
from scenarios.config.sampling import changed, drawn

pytest.importorskip("distributed")

from scenarios.sweep import whole
from scenarios.sweep.planning import Planned
from scenarios.sweep.results import Results
from scenarios.sweep.run import Job
from scenarios.sweep.verdict import success
from scenarios.sweep.whole import Workers, compare_starts

SHORT = {"control.duration": 0.03}


@pytest.fixture(scope="module")
def done(tmp_path_factory, cluster):
    folder = tmp_path_factory.mktemp("starts") / "out"
    found = compare_starts([load("ellipse", SHORT)], ["recursive", "hcod", "augmented"], 7, 3,
                           folder, scheduler=cluster)
    return found, json.loads((folder / "results.json").read_text()), folder


@pytest.mark.parametrize("name", shipped())
def test_every_shipped_scenario_says_what_varies(name):
    scenario = load(name)
    first, second = (drawn(scenario, scenario.variation, 0, index) for index in range(2))
    assert first
    assert first != second
    assert changed(scenario, first, "test").variation == scenario.variation


def test_a_star_stands_for_every_entry_of_a_list():
    ellipse = load("ellipse")
    found = drawn(ellipse, ellipse.variation, 0, 0)
    assert [key for key in found if "obstacles" in key] == [
        f"avoidance.obstacles.{i}.centre" for i in range(3)]
    own = [obstacle.centre for obstacle in ellipse.avoidance.obstacles]
    for i, centre in enumerate(own):
        assert found[f"avoidance.obstacles.{i}.centre"] == pytest.approx(centre, abs=0.005)
        assert found[f"avoidance.obstacles.{i}.centre"] != list(centre)


def test_a_variation_replaces_that_of_the_extended_file(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text('extends = "ellipse"\nname = "mine"\n'
                    '[variation]\nposition.stiffness = { around = 1.0 }\n')
    assert list(load(file).variation) == ["position.stiffness"]


def test_a_phase_starts_the_ellipse_elsewhere():

    path = load("ellipse").position.path
    shifted = path.model_copy(update={"phase": 0.3})
    first, second = np.empty((2, 3, 3))
    path.make().write(1.3, first)
    shifted.make().write(1.0, second)
    np.testing.assert_allclose(second, first, atol=1e-12)


@pytest.mark.slow
def test_every_resolver_gets_the_same_starts(done):
    found, _, _ = done
    starts = {}
    for run in found.plan.runs:
        starts.setdefault(run.label, []).append(run.values["start.q"])
    assert len(starts) == 3
    assert len({str(values) for values in starts.values()}) == 1
    assert len({str(q) for q in starts["hcod"]}) == 7


@pytest.mark.slow
def test_strict_resolvers_are_the_same_and_none_is_best_among_them(done):
    _, data, _ = done
    columns = data["groups"]["ellipse"]["columns"]
    speed = columns["hcod"]["metrics"]["speed_max"]
    assert speed["against_first"]["said"] == "the same"
    assert speed["count"] == 7
    assert not speed["best"]
    assert columns["recursive"]["shares"]["Reached the end"] == {
        "met": 7, "of": 7, "wilson_95": pytest.approx([0.6457, 1.0], abs=1e-4)}


@pytest.mark.slow
def test_the_verdict_and_the_page_say_what_the_statistics_do(done):
    _, data, folder = done
    lines = data["groups"]["ellipse"]["verdict"]
    assert lines[0].startswith("All 21 runs reached the end")
    assert lines[0].endswith("had every tick solved and kept the distance asked for.")
    assert "recursive and hcod behave the same on every sample" in lines[1]
    assert lines[2].endswith("augmented is not strict at every rank and damps differently from "
                             "recursive.")
    page = (folder / "index.html").read_text()
    assert all(line in page for line in lines)
    assert "the same</small>" in page


@pytest.mark.slow
def test_more_starts_keep_the_finished_ones(done, cluster):
    _, _, folder = done
    more = compare_starts([load("ellipse", SHORT)], ["recursive", "hcod", "augmented"], 8, 3,
                          folder, scheduler=cluster)
    assert more.made == 3


@pytest.mark.slow
def test_scenarios_under_their_own_resolvers_are_columns(tmp_path, cluster):
    found = compare_starts([load(name, SHORT) for name in ("ellipse", "ellipse-hqp")], ["own"], 2,
                           0, tmp_path / "out", scheduler=cluster)
    (results,) = found.found.values()
    assert results.labels == ("ellipse", "ellipse-hqp")


def test_workers_start_once_for_several_comparisons_and_not_where_nothing_is_missing(
        done, cluster, monkeypatch):
    _, _, folder = done
    started, connected = [], whole.connected
    monkeypatch.setattr(whole, "connected",
                        lambda *asked: started.append(asked) or connected(*asked))
    with Workers(scheduler=cluster) as workers:
        for starts, asked in ((7, 0), (9, 1), (10, 1)):
            compare_starts([load("ellipse", SHORT)], ["recursive", "hcod", "augmented"], starts, 3,
                           folder, workers=workers)
            assert len(started) == asked


def test_runs_of_the_same_share_are_named_together():
    names = [Planned("a", "a", label, sample, {}, Job("", "", label))
             for sample in range(4) for label in ("tpm", "hcod", "weighted")]
    excess = np.array([0.0 if run.label != "weighted" and run.sample else 1.0 for run in names])
    found = Results(tuple(names), (None,) * 12, {}, {"joint_limit_excess": excess})
    said = "3 of 4 runs under each of tpm and hcod and 0 of 4 runs under weighted kept the joint"
    assert said in success(found)


def test_a_scenario_without_variation_is_refused(tmp_path):
    bare = load("ellipse", {**SHORT, "variation": {}})
    with pytest.raises(HierarchyError, match=r"'ellipse' has no \[variation\]"):
        compare_starts([bare], ["hcod"], 2, 0, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_variation_of_a_key_that_is_not_there_names_it(tmp_path):
    wrong = load("ellipse", {**SHORT, "variation": {"start.p": {"around": 1.0}}})
    with pytest.raises(HierarchyError, match=r"variation\.start\.p: scenario 'ellipse'.*no key"):
        compare_starts([wrong], ["hcod"], 2, 0, tmp_path / "out")
