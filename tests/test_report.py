import dataclasses
import re
from html.parser import HTMLParser

import hand_made
import numpy as np
import pytest
from hand_made import LABELS, HandMadeScenario, recording

from scenarios.compare import Comparison, Run, table
from scenarios.report import page
from scenarios.report.verdict import verdict


def made(spec="tpm", fault=None, error=None, scenario=None, **signals):
    scenario = (scenario or HandMadeScenario()).with_resolver(spec)
    run = None if error else recording(scenario, fault, **signals)
    return Run(scenario, spec, LABELS.get(spec, spec), run, error)


def comparison(*runs):
    return Comparison(runs, "hierarchy compare hand-made", {"python": "3.11"})


def row(runs, label):
    return next(row for row in table(runs) if row.label.startswith(label))


def test_the_best_of_each_row_is_marked():
    runs = [made("tpm", minimal_distance=np.full(5, 0.2)), made("hqp")]
    assert row(runs, "Body distance").best == {1}  # 1 m beats 0.2 m: more is better
    runs = [made("tpm", a=np.ones((5, 7))), made("hqp")]
    assert row(runs, "Joint acceleration").best == {1}


def test_values_within_a_percent_are_equally_good():
    runs = [made("tpm", a=np.full((5, 7), 1.005)), made("hqp", a=np.ones((5, 7))),
            made("recursive", a=np.full((5, 7), 2.0))]
    assert row(runs, "Joint acceleration").best == {0, 1}


def test_where_all_are_equally_good_none_is_marked():
    assert all(not line.best for line in table([made("tpm"), made("hqp")]))


def test_a_run_that_stopped_early_wins_nothing():
    runs = [made("tpm", fault="diverged at tick 5"), made("hqp", a=np.ones((5, 7))),
            made("recursive", a=np.full((5, 7), 2.0))]
    assert row(runs, "Joint acceleration").best == {1}


def test_a_run_that_never_began_has_empty_cells_and_loses_nobody_else_theirs():
    runs = [made("tpm"), made("hqp", error="HierarchyError: cannot")]
    assert row(runs, "Joint speed, max").cells == ("0.000", "–")


def test_the_verdict_is_made_of_what_was_measured():
    runs = [made("tpm", time_resolve=np.full(5, 2e-6), minimal_distance=np.full(5, 0.052)),
            made("hqp", time_resolve=np.full(5, 80e-6))]
    said = verdict(runs)
    assert said.startswith("Both ways ran the whole 4 s")
    assert "at least 52 mm" in said
    assert "tpm published resolves a tick in 2 µs, hqp in 80 µs" in said


def test_the_verdict_says_which_ways_did_not_finish_and_takes_nothing_from_them():
    runs = [made("tpm"), made("hqp", fault="diverged", minimal_distance=np.full(5, 0.001))]
    said = verdict(runs)
    assert said.startswith("One of two ways ran the whole 4 s (hqp did not)")
    assert "at least 1000 mm" in said


def test_the_verdict_tells_who_moved_alike_and_what_the_others_did_instead():
    runs = [made("tpm", minimal_distance=np.full(5, 0.04)),
            made("recursive", q=np.full((5, 7), 1e-11), minimal_distance=np.full(5, 0.04)),
            made("augmented", q=np.full((5, 7), 0.3), minimal_distance=np.full(5, 0.02))]
    assert ("tpm published and recursive moved the arm alike to 1e-11 rad, augmented did not "
            "(body to obstacle 20 mm against 40 mm)") in verdict(runs)


def test_the_verdict_finds_no_agreement_where_there_is_none():
    assert "no two moved the arm alike" in verdict([made("tpm"), made("hqp", q=np.ones((5, 7)))])


def test_the_verdict_does_not_hide_a_collision():
    assert "touched an obstacle" in verdict([made("tpm", minimal_distance=np.zeros(5))])


def test_the_verdict_of_runs_that_all_broke_is_only_that():
    assert verdict([made("hqp", error="broke")]) == "No way ran the whole 4 s (hqp did not)."


@pytest.mark.parametrize("runs", [
    [made("tpm")],
    [made("tpm"), made("tpm:form=staircase"), made("recursive")],
    [made("tpm"), made("hqp", fault="diverged at tick 5")],
    [made("tpm"), made("hqp", error="HierarchyError: cannot")],
    [made("hqp", error="HierarchyError: cannot")],
    [made("tpm", t=[0.0])],
    [made("tpm"), made("tpm", scenario=HandMadeScenario(name="other"))],
    [made("tpm", scenario=HandMadeScenario(pointing=None, avoidance=None))],
], ids=["one", "three", "a fault", "an error", "only an error", "one tick", "two scenarios",
        "no tasks but position"])
def test_a_page_is_whole_and_needs_nothing_outside_itself(runs):
    text = page(comparison(*runs))
    balanced(text)
    assert not re.search(r"""(?:src|href)=["']?(?:https?:)?//""", text)
    assert not re.search(r"<(?:script|link|img|iframe)\b|@import|url\((?!#)", text)


def test_one_resolver_in_several_scenarios_is_one_table_and_nothing_is_best():
    asked = [HandMadeScenario(name=name) for name in ("slow", "jumpy")]
    runs = [dataclasses.replace(made("tpm", scenario=one, v=speed * np.eye(5, 7)), label=one.name)
            for one, speed in zip(asked, (0.1, 2.0), strict=True)]
    text = page(comparison(*runs))
    assert list(comparison(*runs).groups()) == ["tpm"]
    assert all(not line.best for line in table(runs))
    assert "0.1 rad/s in slow, 2 rad/s in jumpy" in text
    assert "none is marked as best" in text


def test_several_resolvers_in_several_scenarios_are_a_section_each():
    runs = [made(spec, scenario=HandMadeScenario(name=name))
            for name in ("one", "other") for spec in ("tpm", "hqp")]
    assert list(comparison(*runs).groups()) == ["one", "other"]


def test_the_page_shows_table_then_figures_then_settings_then_command():
    text = page(comparison(made("tpm"), made("hqp")))
    places = [text.index(mark) for mark in ("<table", "Joint velocities", "<h2>Settings",
                                            "hierarchy compare hand-made</code>")]
    assert places == sorted(places)


def test_the_page_says_what_happened_to_a_run_that_faulted():
    text = page(comparison(made("tpm"), made("hqp", fault="the state is not finite from tick 5")))
    assert "the state is not finite from tick 5" in text
    assert "stopped at" in text


def test_text_from_a_scenario_file_cannot_become_markup():
    scenario = dataclasses.replace(HandMadeScenario(), title="<script>alert(1)</script> & co")
    text = page(comparison(made("tpm", scenario=scenario)))
    assert "<script>" not in text
    assert "&lt;script&gt;" in text


def test_a_page_of_long_runs_stays_small():
    ticks = 20_000
    noise = np.random.default_rng(0).normal(size=(ticks, 7))
    runs = [made(spec, t=np.arange(ticks) * 1e-3, q=noise, v=noise, a=noise,
                 position_error=noise[:, :3], pointing_error=noise[:, 0],
                 active_control_point=np.full(ticks, 6), minimal_distance=np.abs(noise[:, 0]),
                 control_point_distance=np.ones((ticks, 8)), ee_distance=np.abs(noise[:, 1]))
            for spec in ("tpm", "recursive", "augmented", "hqp", "tpm:form=staircase")]
    assert len(page(comparison(*runs)).encode()) < 3_000_000


def balanced(text):
    """Fail unless every element that is opened is closed, in order."""
    open_ones = []

    class Checker(HTMLParser):
        def handle_starttag(self, tag, attrs):
            if tag not in ("meta", "br"):
                open_ones.append(tag)

        def handle_endtag(self, tag):
            assert open_ones.pop() == tag

    Checker().feed(text)
    assert open_ones == []


def test_the_hand_made_scenario_is_no_more_than_what_a_scenario_has():
    from scenarios.config import Scenario

    fields = {field.name for field in dataclasses.fields(hand_made.HandMadeScenario)}
    assert fields - {"resolver"} <= set(Scenario.model_fields)
