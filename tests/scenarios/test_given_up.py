"""Which levels a run gave up, for how long, and what held them back."""

import pytest

from scenarios import load, simulate
from scenarios.measure.given_up import given_up

pytestmark = pytest.mark.slow


def test_a_step_that_is_too_fast_is_held_back_by_the_joints_at_their_limits():
    run = simulate(load("strictness", ["control.duration=0.3"]))
    position, posture = given_up(run)
    assert (position.level, posture.level) == ("position", "posture")
    assert 0.5 < position.share <= 1.0
    assert position.seconds == pytest.approx(position.share * 0.3)
    held = dict(position.held_by)
    assert max(held.values()) == 1.0
    assert all(name.startswith("joint limits joint_") and name.endswith(" side") for name in held)
    assert "position" in dict(posture.held_by)
    assert str(position).startswith(f"row missed: position in {100 * position.share:.0f} % of its "
                                    f"ticks ({position.seconds:.3g} s); held back by joint limits ")


def test_a_run_that_meets_all_gives_nothing_up():
    assert given_up(simulate(load("ellipse-hqp", ["control.duration=0.05"]))) == ()


def test_only_how_long_is_said_where_the_rows_are_not_known():
    changes = ["control.duration=0.05", "avoidance.distance=0.12", "avoidance.influence=0.4"]
    for one in given_up(simulate(load("ellipse-smooth", changes))):
        assert one.held_by == ()
        assert 0.0 < one.share <= 1.0
