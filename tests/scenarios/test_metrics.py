"""Numbers of a run, by signals made by hand; jitter."""

from types import SimpleNamespace

import numpy as np
import pytest
from hand_made import asked, recording

from scenarios import load
from scenarios.measure.metrics import Metric, as_plain_data, measure
from scenarios.recording import listed


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
        position_error=error[:, None] * [1.0, 0.0, 0.0]))
    assert found["ticks_frozen"].value == len(frozen)
    assert found["error_returned_max"].value == (error[returned].max() if returned else None)
    assert found["error_returned_rms"].value == (
        pytest.approx(np.sqrt(np.mean(error[returned]**2))) if returned else None)
    assert found["jerk_max"].value == 2.0
