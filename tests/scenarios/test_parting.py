"""Where strict resolvers part: the tick, and what was different before it."""


import numpy as np
import pytest
from hand_made import HandMadeScenario, recording

from scenarios.config.resolvers import default_resolvers
from scenarios.measure.motions import motions
from scenarios.measure.partings import partings
from scenarios.measure.runs import Run
from solvers.qp import backends

LETTER = "tpm-published"


def run_of(spec, q=None, fault=None, **changed):
    scenario = HandMadeScenario().with_resolver(spec)
    q = np.zeros((5, 7)) if q is None else q
    return Run(scenario, spec, spec, recording(scenario, fault, q=q, **changed))


def away_from(tick, by=1e-3):
    q = np.zeros((5, 7))
    q[tick:, 2] = by
    return q


def test_runs_that_are_one_motion_are_as_far_apart_as_the_farthest_of_them():
    (one,) = motions([run_of("recursive"), run_of("hqp", away_from(1, 5e-6)),
                      run_of("hcod", away_from(1, 2e-6))])
    assert one.labels == ("recursive", "hqp", "hcod")
    assert one.apart == 5e-6


def test_the_first_tick_beyond_the_bound_is_named():
    (one,) = partings([run_of("recursive"), run_of("hqp", away_from(3))])
    assert one.tick == 3
    assert "at tick 3 (3.00 s), by 1.0e-03 rad at most" in str(one)
    assert "the motion magnifies the errors of each tick (declared: 1e-09)" in one.why


@pytest.mark.parametrize(("tick", "is_the_reason"), [(3, True), (4, False)])
def test_a_tick_is_a_reason_only_where_it_was_not_solved_before_the_runs_diverge(tick,
                                                                                 is_the_reason):
    failing = run_of("hqp", away_from(3), status=3 * (np.arange(5) == tick))
    (one,) = partings([run_of("recursive"), failing])
    assert (one.why == f"tick {tick} of hqp was not solved") == is_the_reason


def test_a_stack_switched_at_another_tick_is_the_reason():
    switched = run_of("hqp", away_from(3), order=np.array([0, 1, 0, 0, 0]))
    assert "another one at tick 1" in partings([run_of("recursive"), switched])[0].why


def test_a_run_that_is_not_finite_has_parted():
    (one,) = partings([run_of("recursive"), run_of("hqp", away_from(2, np.nan))])
    assert one.tick == 2
    assert one.largest == np.inf


def test_resolvers_that_are_not_strict_need_not_agree():
    """Neither as the one compared with, nor as the one compared."""
    assert partings([run_of(LETTER), run_of("recursive"), run_of("augmented", away_from(1))]) == []


def test_a_backend_that_is_not_installed_leaves_the_default_comparison_and_is_named(monkeypatch):
    everything, nothing = default_resolvers()
    assert not nothing
    monkeypatch.setattr(backends, "installed", lambda name: name != "daqp")
    rest, missing = default_resolvers()
    assert set(everything) - set(rest) == {"hqp:backend=daqp"}
    assert missing == {"hqp:backend=daqp": "pip install 'task-hierarchy[qp]'"}
