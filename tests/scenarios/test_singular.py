"""Paths through singularities and out of reach: the jitter, the scenarios, and what is measured."""

import numpy as np
import pytest

from hierarchy.paths import Jittered, Still
from scenarios.config import load
from scenarios.loop.simulation import simulate
from scenarios.measure.metrics import measure
from scenarios.measure.tracking import frozen, jerk, returned, within_reach

NAMES = ("singular", "singular-limits", "singular-acceleration", "singular-acceleration-limits")


def jittered(seed=3):
    return Jittered(Still((1.0, 2.0, 3.0)), amplitude=0.002, rate=4.0, seed=seed)


def test_jitter_is_bounded_moves_in_every_axis_and_depends_on_its_seed_alone():
    offsets = np.array([jittered()(t)[0] for t in np.arange(0.0, 5.0, 0.01)]) - [1.0, 2.0, 3.0]
    assert np.abs(offsets).max() <= 0.002
    assert (np.abs(offsets).max(axis=0) > 0.0005).all()
    assert np.array_equal(jittered()(0.7), jittered()(0.7))
    assert not np.allclose(jittered()(0.7)[0], jittered(seed=4)(0.7)[0])


def test_frozen_returned_and_jerk_are_counted():
    t = np.arange(6.0)
    spans = ((1.0, 2.0), (4.0, 4.5))
    assert within_reach(t, spans).tolist() == [True, False, False, True, False, True]
    assert returned(t, spans, 0.5).tolist() == [False, False, False, True, False, False]
    v = np.zeros((6, 2))
    v[5] = 1.0
    error = np.array([0.0, 1.0, 1.0, 1.0, 1.0, 1.0])
    assert frozen(t, v, error, spans).tolist() == [False, False, False, True, False, False]
    assert frozen(t, v, error, ()).tolist() == [False, True, True, True, True, False]
    t = np.array([0.0, 0.1, 0.3])
    np.testing.assert_allclose(jerk(t, np.array([[0.0], [1.0], [3.0]])), [[10.0], [10.0]])


@pytest.mark.parametrize("name", NAMES)
def test_a_run_has_the_metrics_of_singularities(name):
    found = measure(simulate(load(name, ["control.duration=0.05"])))
    assert found["ticks_frozen"].value == 0.0
    assert found["error_returned_max"].value is None  # it has not been away
    assert found["jerk_max"].value > 0.0
    assert found["speed_limit_excess"].value == 0.0
