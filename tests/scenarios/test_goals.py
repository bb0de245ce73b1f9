"""Goals and numbers of a run, what samples tell, and why an answer jumps."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hand_made import asked, recording
from scipy.stats import PermutationMethod, wilcoxon

from hierarchy import Hierarchy
from scenarios import load, simulate
from scenarios.measure.causes import Tick, causes
from scenarios.measure.goals import Goal, goals, percent
from scenarios.measure.happenings import happened
from scenarios.measure.metrics import Metric, as_plain_data, measure
from scenarios.measure.runs import Run
from scenarios.measure.statistics import EXACT, best, paired, wilson
from scenarios.measure.verdict import Verdict, lines, verdicts
from scenarios.recording import listed
from solvers import make


def goal(name, fault=None, **signals):
    return next(one for one in goals(recording(fault=fault, **signals)) if one.name == name)


def at(x):
    """Five errors of position along one axis, in mm, as the signals of a path at rest."""
    desired = np.outer(1e-3 * np.asarray(x, float), (1.0, 0.0, 0.0))
    return {"desired_position": desired, "position_error": desired}


def joint(values):
    return {"q": np.outer(values, np.eye(7)[0])}  # limits are -2 and 2


def test_median_worst_and_share_count_from_when_the_target_was_first_reached():
    one = goal("position", **at([90, 0, 0.5, 4, 3]))
    assert (one.reached, one.first) == (1.0, 3.0)
    assert (one.median, one.worst, one.share) == pytest.approx((1.75e-3, 4e-3, 0.5))
    assert (one.flag, one.unit) == ("left", "m")


@pytest.mark.parametrize(("share", "said"), [
    (0.5, "50 %"), (0.994, "99 %"), (0.9951, "99.5 %"), (0.99999, "99.9 %"), (1.0, "100 %")])
def test_only_a_whole_share_is_said_to_be_all_of_it(share, said):
    assert percent(share) == said


@pytest.mark.parametrize(("signals", "name", "flag", "worst", "unit"), [
    (at([0.25, 0.5, 0.25, 0.25, 1.0]), "position", "met", 1e-3, "m"),
    (at([90, 1.0, 0.5, 0.25, 0.5]), "position", "met", 1e-3, "m"),
    (at([437] * 5), "position", "never met", 0.437, "m"),
    (joint([0.0] * 5), "joint limits", "kept", 0.0, "rad"),
    (joint([2.5, 2.2, 1.9, 1.9, 1.9]), "joint limits", "kept", 0.0, "rad"),        # came back
    (joint([2.5, 2.7, 1.9, 1.9, 1.9]), "joint limits", "broken", 0.2, "rad"),      # after more
    (joint([2.5, 1.9, 2.1, 1.9, 1.9]), "joint limits", "broken", 0.1, "rad"),      # and out again
    (joint([2.5, 2.4, 2.4, 2.4, 2.4]), "joint limits", "never kept", 0.5, "rad"),  # stayed
    (joint([0.0, 2.3, -2.1, 0.0, 0.0]), "joint limits", "broken", 0.3, "rad"),
    ({"pointing_error": 0.5 - np.cos(np.radians([60.0, 58.0, 76.0, 60.0, 60.0]))}, "pointing",
     "broken", 16.0, "deg"),
    ({"v": np.diag([0, 0, 4.0, 0, 0, 0, 0])[:5], "velocity_limit": np.full(7, 3.0)},
     "speed limits", "broken", 1.0, "rad/s"),
    ({"v": np.diag([0, 0, 3.0005, 0, 0, 0, 0])[:5], "velocity_limit": np.full(7, 3.0)},
     "speed limits", "kept", 5e-4, "rad/s"),
    ({"contact_depth": [0, 2e-3, 0, 0, 0], "contacts": np.zeros(5)},
     "no contact with obstacles", "broken", 2e-3, "m")])
def test_a_goal_has_a_flag_and_its_worst_distance(signals, name, flag, worst, unit):
    one = goal(name, **signals)
    assert (one.flag, one.worst, one.unit) == (flag, pytest.approx(worst), unit)


def test_goals_of_one_name_in_two_units_are_not_weighed_against_each_other():
    hand = Goal("hand", "", "m", False, 1e-3, 0.02, 0.02, 0.5, 0.0, 0.0)
    off = lines([Verdict(unit, 1.0, 1.0, None, False, (replace(hand, unit=unit),))
                 for unit in ("m", "deg")])[-1]
    assert off.count("at worst") == 2


def test_a_run_lasts_as_long_as_its_whole_ticks():
    scenario = load("ellipse", {"control.period": 0.3, "control.duration": 1.0})
    (found,) = verdicts([Run(scenario, "a", "a", recording(scenario, t=[0.0, 0.3, 0.6]))])
    assert found.end == "ran the whole 0.9 s"


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


def test_pairs_are_counted_by_their_direction_and_too_few_tell_nothing():
    first = np.array([1.0, 2.0, 3.0, 4.0, np.nan, 6.0])
    found = paired(first, np.array([1.0, 1.0, 5.0, 4.0 * (1 + 1e-4), 5.0, np.inf]))
    assert (found.count, found.alone, found.same, found.lower, found.higher) == (4, 2, 2, 1, 1)
    assert [replace(found, p=p, higher=2, ranks=0.1).distinguishable for p in (0.0499, 0.05)] == [
        True, False]
    assert str(found) == "not distinguishable; 2 without a pair"
    assert not paired(np.zeros(5), np.ones(5)).distinguishable
    assert paired(np.zeros(6), np.arange(1.0, 7.0)).distinguishable
    assert str(paired(np.full(3, np.nan), np.ones(3))) == "no pair; 3 without a pair"
    assert str(paired(np.zeros(9), np.full(9, 1e-10))) == "the same"  # rounding
    many = np.r_[np.full(26, -1.0), np.full(24, 2.0)]  # more are lower, but by less
    assert paired(np.zeros(50), many).p < 0.01
    assert str(paired(np.zeros(50), many)) == "not distinguishable"


LOW, NORMAL = np.linspace(1.0, 1.5, 16), np.random.default_rng(2).normal(size=(2, 16))
# One pair of 8 against the trend: p = 0.016 alone, too much for ten rivals after Holm.
APART = np.array([1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, -0.5])
HOLES = np.where(np.arange(16) < 3, np.nan, 0.0)


@pytest.mark.parametrize(("columns", "lower", "marked"), [
    ([LOW, LOW + 1.0, LOW * (1.0 + 1e-10), LOW + 2.0], True, (0, 2)),
    ([LOW, LOW + 1.0, LOW * (1.0 + 1e-10), LOW + 2.0], False, (3,)),
    ([NORMAL[0], NORMAL[0] + NORMAL[1], NORMAL[0] + 5.0], True, ()),
    ([LOW, LOW.copy()], True, ()), ([LOW, np.full(16, np.nan)], True, ()), ([LOW], True, ()),
    ([LOW, LOW + np.r_[np.full(12, 1.0), np.full(4, -50.0)]], True, ()),
    ([np.zeros(8), APART], True, (0,)),
    ([LOW * (1.0 + 1e-12), LOW + 1.0, LOW], True, (0, 2)), ([1e-12 * LOW, 2e-12 * LOW], True, ()),
    ([LOW, np.where(LOW < 1.2, LOW + 1.0, LOW)], True, (0,)),
    ([LOW, LOW + 1.0 + HOLES], True, (0,)), ([LOW + HOLES, LOW + 1.0], True, ()),
    ([LOW, LOW + 1.0, LOW + HOLES], True, ()),
    ([np.full(16, 2.0), np.repeat([2.0, 3.0], [9, 7])], True, (0,)),
    ([np.repeat([2.0, 3.0], [9, 7]), np.full(16, 2.0)], True, (1,)),  # the medians are equal
    ([np.zeros(8), *(APART * (1.0 + 0.01 * i) for i in range(10))], True, ())])
def test_the_best_is_marked_with_those_equal_to_it_where_all_others_can_be_told_from_it(
        columns, lower, marked):
    assert best(dict(enumerate(columns)), lower_is_better=lower) == marked
    assert best({i: -one for i, one in enumerate(columns)}, lower_is_better=not lower) == marked


@pytest.mark.parametrize(("met", "of", "low", "high"), [
    (18, 24, 0.551, 0.880),  # Wilson 1927
    (0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (81, 263, 0.2553, 0.3662), (0, 0, 0.0, 1.0)])
def test_the_interval_of_a_share_is_wilsons(met, of, low, high):
    assert wilson(met, of) == pytest.approx((low, high), abs=1e-4)


def tick(box, task, reference=(0.0, 0.0), names=("box", "task", "rest")):
    """A box of two unknowns (2, 2), a task (row, target) and a last row of zeros, answered."""
    levels = [(np.eye(2), *np.array(box, dtype=float)),
              (np.array([task[0]], dtype=float), [task[1]]), (np.zeros((1, 2)), [0.0])]
    h = Hierarchy.from_levels(levels, reference, names)
    return Tick(h, answer(h), np.hstack([np.eye(2), np.zeros((2, 1))]))


def answer(h):
    return make("hcod").solve(h).x


def said(before, after):
    return [f"{kind}: {text}" for kind, text in causes(before, after, answer)]


WIDE = ((-1.0, -1.0), (1.0, 1.0))


def test_a_level_that_gains_nothing_by_another_corner_sits_at_a_vertex():
    """x1 is at 1; the least weight of x2 in the task decides which of its ends is chosen."""
    (text,) = said(tick(WIDE, ((1.0, -1e-6), 10.0)), tick(WIDE, ((1.0, 1e-6), 10.0)))
    assert text.startswith("vertex: task, missed by 9, sits at a vertex: it gains ")
    assert text.endswith("by another answer to the same data, 1 of the 2 apart")


def test_what_moved_is_named_with_what_is_left_without_it():
    before, after = (tick(((-1.0, -1.0), (upper, 1.0)), ((1.0, 0.0), 3.0)) for upper in (1.0, 2.0))
    assert said(before, after) == [
        "side: upper side of row 0 in box moved by 1, from 1 to 2; without that the change is 0"]
    assert said(*(tick(WIDE, ((0.7, -1.0), by), reference=(0.3, 0.7)) for by in (0.0, 3.0))) == [
        "side: target of row 0 in task moved by 3, from 0 to 3; without that the change is 0",
        "miss: task changed from met to missed by 1.3"]  # 0 is met but for rounding
    assert said(tick(WIDE, ((1.0, 0.0), 0.0)),
                tick(WIDE, ((1.0, 0.0), 0.0), reference=(0.0, 0.5))) == [
        "reference: the reference moved; without that the change is 0"]


def test_levels_and_sides_that_come_and_go_are_all_that_is_said():
    one = tick(WIDE, ((1.0, 0.0), 3.0))
    other = tick(WIDE, ((1.0, 0.0), 3.0), names=("box", "hand", "rest"))
    assert said(one, other) == ["stack: the levels were box, task, rest and are box, hand, rest"]
    opened = tick(((-1.0, -1.0), (np.inf, 1.0)), ((1.0, 0.0), 3.0))
    assert said(one, opened) == ["stack: the upper side of row 0 in box vanished"]


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


def test_an_answer_that_the_resolver_does_not_give_is_not_blamed_on_the_rows():
    before = tick(WIDE, ((1.0, 0.0), 0.5))
    (text,) = said(before, before._replace(x=np.array([-0.9, 0.0])))
    assert text.startswith("other: one of two answers to the same data was not sent as it is")


@pytest.mark.parametrize(("step", "shown"), [(50.0 * (1.0 + 1e-14), 0), (50.1, 1)])
def test_changes_that_the_metrics_do_not_count_are_not_explained(step, shown):
    """A robot at its limit of acceleration changed by 0.1 rad/s in each tick, but for rounding."""
    command = np.outer(np.arange(5) > 2, step * np.eye(7)[3])
    run = recording(command=command, a=command)
    assert len([*happened(run)]) == measure(run)["acceleration_step_ticks"].value == shown


def test_an_error_of_a_listed_task_that_only_rounding_makes_is_none(monkeypatch):
    """Below 1e-9 [m, deg, rad]; 1e-9 itself counts."""
    hand, elbow = (SimpleNamespace(kind="position", title=title) for title in ("hand", "elbow"))
    monkeypatch.setattr(listed, "errors", lambda run: [
        (hand, "m", np.array([0.0, 9e-10, 1e-12, 5e-10, 9e-10])),
        (elbow, "m", np.array([0.0, 0.0, 0.0, 0.0, 1e-9]))])
    found = measure(recording(asked(tasks=(hand, elbow))))
    assert found["task_hand_rms"].label == "Hand: error, rms"
    for key in ("rms", "max_settled", "end"):
        assert found[f"task_hand_{key}"].value == 0.0
        assert found[f"task_elbow_{key}"].value > 0.0


def test_the_error_of_a_task_that_cannot_be_read_is_none():
    assert np.isnan(listed._error_reader(SimpleNamespace(), None)())
    plain = SimpleNamespace(error_reader=lambda state: lambda: 3.0)
    assert listed._error_reader(plain, None)() == 3.0


@pytest.mark.parametrize(("value", "unit", "shown"), [
    *((12.3456789, unit, shown) for unit, shown in (
        ("m", "12346"), ("s", "12.346"), ("deg", "12.346"), ("share", "1235"), ("rad", "12.346"),
        ("rad/s", "12.346"), ("rad/s^2", "12.35"), ("rad/s^3", "12"), ("N", "12.3"), ("", "12"))),
    (0.0123, "rad", "0.012"), (0.00649, "rad", "0.0065"), (0.0004, "rad", "4.0e-04"),
    (0.0, "", "0"), (0.25, "", "0.25"), (1.5, "", "1.5"), (3.0, "", "3"), (12.5, "", "12"),
    (4e-3, "", "4.0e-03"), (0.01, "", "0.01"), (10.0, "", "10"), (1e3, "rad", "1000"),
    (1e5, "rad", "1.0e+05")])
def test_each_unit_has_its_decimals_and_a_small_number_a_digit_more(value, unit, shown):
    assert Metric("some", "Some", value, unit).shown() == shown


def test_a_number_that_is_not_finite_is_left_out_of_the_file_and_not_passed_off_as_one():
    data = as_plain_data(recording(a=np.full((5, 2), np.nan), fault="diverged at tick 5"))
    assert data["metrics"]["acceleration_max"]["value"] is None
    assert (data["fault"], data["ticks"]) == ("diverged at tick 5", 5)


def test_a_floating_base_is_no_joint():
    run = simulate(load("humanoid", ["control.duration=0.05"]))
    slow = measure(run)
    for name in ("v", "a", "command"):
        run.signals[name][1, :6] = 99.0
    fast = measure(run)
    for name in ("speed_max", "velocity_step_max", "command_step_max", "acceleration_max",
                 "acceleration_step_ticks"):
        assert fast[name].value == slow[name].value


def test_distances_are_judged_by_the_true_ones_where_a_sensor_measured_others():
    far = load("ellipse-hqp", {"avoidance.distance": 0.2, "avoidance.influence": 0.3})
    found = measure(recording(
        far, minimal_distance=[1, 0.05, 1, 1, 1], ee_distance=[1, 1, 1, 0.02, 1],
        true_minimal_distance=[1, 0.4, 0.3, 1, 1], true_ee_distance=[1, 1, 0.35, 1, 1]))
    assert (found["body_distance_min"].value, found["ee_distance_min"].value) == (0.3, 0.35)
    measured = found["body_distance_min_measured"], found["ee_distance_min_measured"]
    assert [metric.value for metric in measured] == [0.05, 0.02]
    assert all(metric.detail and metric.lower_is_better is None for metric in measured)
    found = measure(recording(far, minimal_distance=np.zeros(5), ee_distance=np.zeros(5),
                              true_minimal_distance=[0.2, 0.19995, 0.1998, 0.1, 1.0],
                              true_ee_distance=[0.2, 0.4, 0.1, 0.4, np.nan]))
    assert found["body_below_share"].value == pytest.approx(2 / 5)  # 0.05 mm is rounding
    assert found["ee_below_share"].value == pytest.approx(1 / 4)    # of the ticks in which known
    assert found["ee_below_share"].note == "nearer than 0.2 m"


@pytest.mark.parametrize(("spans", "frozen", "returned"), [
    (((1.0, 2.0), (4.0, 4.5)), [3], [3]), (((1.0, 2.0),), [3, 4], [3, 4, 5]),
    (((4.0, 5.0),), [1, 2, 3], [])])
def test_frozen_returned_and_jerk_are_counted(spans, frozen, returned):
    v, a, error = np.zeros((6, 7)), np.zeros((6, 7)), np.array([0.0, 1.0, 1.5, 2.0, 3.0, 4.0])
    v[5], a[:, 2] = 1.0, [0.0, 1.0, 3.0, 3.0, 3.0, 3.0]
    path = SimpleNamespace(out_of_reach=spans)
    found = measure(recording(
        asked(position=SimpleNamespace(path=path)), t=np.arange(6.0), v=v, a=a,
        position_error=np.zeros((6, 3)), desired_position=error[:, None] * [1.0, 0.0, 0.0]))
    assert found["ticks_frozen"].value == len(frozen)
    assert found["error_returned_max"].value == (error[returned].max() if returned else None)
    assert found["error_returned_rms"].value == (
        pytest.approx(np.sqrt(np.mean(error[returned]**2))) if returned else None)
    assert found["jerk_max"].value == 2.0
