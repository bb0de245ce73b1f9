"""Paths through singularities and out of reach: the jitter, the scenarios, and what is measured."""

from types import SimpleNamespace

import numpy as np
import pytest
from hand_made import HandMadeScenario, recording

from hierarchy.paths import Jittered, Still
from scenarios.config import load
from scenarios.loop.simulation import simulate
from scenarios.measure.metrics import measure

NAMES = ("singular", "singular-limits", "singular-acceleration", "singular-acceleration-limits")


def jittered(seed=3):
    return Jittered(Still((1.0, 2.0, 3.0)), amplitude=0.002, rate=4.0, seed=seed)


def test_jitter_is_bounded_moves_in_every_axis_and_depends_on_its_seed_alone():
    offsets = np.array([jittered()(t)[0] for t in np.arange(0.0, 5.0, 0.01)]) - [1.0, 2.0, 3.0]
    assert np.abs(offsets).max() <= 0.002
    assert (np.abs(offsets).max(axis=0) > 0.0005).all()
    assert np.array_equal(jittered()(0.7), jittered()(0.7))
    assert not np.allclose(jittered()(0.7)[0], jittered(seed=4)(0.7)[0])


@pytest.mark.parametrize(("spans", "frozen", "returned"), [
    (((1.0, 2.0), (4.0, 4.5)), [3], [3]), (((1.0, 2.0),), [3, 4], [3, 4, 5]),
    (((4.0, 5.0),), [1, 2, 3], [])])
def test_frozen_returned_and_jerk_are_counted(spans, frozen, returned):
    v, a, error = np.zeros((6, 7)), np.zeros((6, 7)), np.array([0.0, 1.0, 1.5, 2.0, 3.0, 4.0])
    v[5], a[:, 2] = 1.0, [0.0, 1.0, 3.0, 3.0, 3.0, 3.0]
    path = SimpleNamespace(out_of_reach=spans)
    found = measure(recording(
        HandMadeScenario(position=SimpleNamespace(path=path)), t=np.arange(6.0), v=v, a=a,
        position_error=error[:, None] * [1.0, 0.0, 0.0]))
    assert found["ticks_frozen"].value == len(frozen)
    assert found["error_returned_max"].value == (error[returned].max() if returned else None)
    assert found["error_returned_rms"].value == (
        pytest.approx(np.sqrt(np.mean(error[returned]**2))) if returned else None)
    assert found["jerk_max"].value == 2.0


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_run_has_the_metrics_of_singularities(name):
    found = measure(simulate(load(name, ["control.duration=0.05"])))
    assert found["ticks_frozen"].value == 0.0
    assert found["error_returned_max"].value is None  # it has not been away
    assert found["jerk_max"].value > 0.0
    assert found["speed_limit_excess"].value == 0.0
