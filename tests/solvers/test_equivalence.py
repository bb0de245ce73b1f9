"""Every strict resolver is the same controller: on the stacks of the letter, tick for tick."""

import numpy as np
import pytest

from scenarios.config import load
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate
from solvers import Status, certify, make, names
from solvers.qp.backends import BACKENDS

STRICT = [make(name) for name in names() if name != "hqp" and make(name).strict]
BACKENDS_AND_FORMS = [make("hqp", backend=backend, form=form)
                      for backend in BACKENDS for form in ("null-space", "slack")]
LEVELS = {"acceleration": "ellipse", "velocity": "ellipse-velocity"}
EVERY = 750  # ticks between two stacks that every backend resolves


@pytest.fixture(scope="module")
def runs():
    return {level: simulate(load(name)) for level, name in LEVELS.items()}


def stacks(run, reference):
    """Hierarchies along a run, with the null-space term or without."""
    controller = Controller(run.scenario)
    for k in range(0, run.ticks, EVERY):
        controller.command(run["t"][k], run["q"][k], run["v"][k])
        h = controller.hierarchy
        h.reference[:] = np.sin(np.arange(h.n) + k) if reference else 0.0
        yield h


@pytest.mark.slow
@pytest.mark.parametrize("resolver", [*STRICT, *BACKENDS_AND_FORMS],
                         ids=lambda r: r.label.replace(" ", "-"))
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("reference", [False, True], ids=["no_reference", "reference"])
def test_every_strict_resolver_commands_what_the_staircase_does(resolver, level, reference, runs):
    staircase, solved = make("tpm"), 0
    for h in stacks(runs[level], reference):
        expected, res = staircase.solve(h), resolver.solve(h)
        assert np.isfinite(res.x).all()
        if res.status is not Status.SOLVED:
            assert resolver in BACKENDS_AND_FORMS
            continue
        solved += 1
        size = 1.0 + np.abs(expected.x).max()
        assert np.abs(res.x - expected.x).max() <= resolver.accuracy * size
        assert certify(h, res.x, 10.0 * resolver.accuracy).optimal
    assert solved >= 0.9 * (18850 // EVERY)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ellipse", "ellipse-velocity"])
def test_hcod_and_recursion_and_the_staircase_are_the_same_run(name):
    """Over all 18,850 ticks, singularities damped alike: (7) equals (5), (12) equals (13)."""
    scenario = load(name)
    staircase, *others = (simulate(scenario.with_resolver(spec))
                          for spec in ("tpm", "recursive", "hcod"))
    for other in others:
        assert other.ticks == staircase.ticks == 18850
        np.testing.assert_allclose(other["q"], staircase["q"], rtol=0, atol=1e-8)
        np.testing.assert_array_equal(other["order"], staircase["order"])
