"""How far a run was from each goal, by signals made by hand."""

import numpy as np
import pytest
from hand_made import recording

from scenarios.measure.goals import goals
from scenarios.measure.verdict import lines, verdict


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


def test_a_target_that_is_never_reached_counts_from_the_start():
    one = goal("position", **at([437, 437, 500, 400, 437]))
    assert (one.flag, one.share, one.reached) == ("never met", 1.0, None)
    assert one.median == pytest.approx(0.437)


@pytest.mark.parametrize(("q", "flag", "worst"), [
    ([2.5, 2.2, 1.9, 1.9, 1.9], "kept", 0.0),           # came back
    ([2.5, 2.7, 1.9, 1.9, 1.9], "broken", 0.2),         # went further first
    ([2.5, 1.9, 2.1, 1.9, 1.9], "broken", 0.1),         # and out again
    ([2.5, 2.4, 2.4, 2.4, 2.4], "never kept", 0.5),     # stayed
    ([0.0, 2.3, -2.1, 0.0, 0.0], "broken", 0.3)])
def test_who_starts_beyond_a_limit_and_comes_back_has_not_passed_it(q, flag, worst):
    one = goal("joint limits", **joint(q))
    assert (one.flag, one.worst) == (flag, pytest.approx(worst))


def test_a_distance_is_a_promise_in_metres_and_an_unknown_one_is_no_breach():
    one = goal("body", minimal_distance=[1.0, np.nan, 0.03, 1.0, 1.0])  # 50 mm are asked
    assert one.promise
    assert (one.worst, one.share) == pytest.approx((0.02, 0.25))


def test_a_cone_is_kept_in_degrees():
    error = np.cos(np.radians(60.0)) - np.cos(np.radians([60.0, 58.0, 76.0, 60.0, 60.0]))
    one = goal("pointing", pointing_error=error)
    assert (one.flag, one.worst, one.unit) == ("broken", pytest.approx(16.0), "deg")


def test_three_sentences_say_the_end_the_promises_and_the_targets():
    found = [verdict(recording(**at([2, 2, 2, 2, 2])), "a"),
             verdict(recording(fault="the robot has fallen by 1 m", **joint([0, 0, 0, 0, 2.5])),
                     "b")]
    end, promises, targets = lines(found)
    assert end.startswith("1 of 2 ran to the end; b fell at ")
    assert promises == "Broken: joint limits by b, 0.5 rad at worst, for 20 % of the time."
    assert targets == "Off in the median: position 0 mm (b) to 2 mm (a), 2 mm at worst."
