"""From one stack to the next without a jump."""

import numpy as np
import oracle
import pytest
import scene

from hierarchy import Hierarchy, Stack
from hierarchy.tasks import JointLimits
from scenarios.loop.transition import Blend, Key
from solvers import make

A, B, C = Key(("position",)), Key(("position", "pointing")), Key(("pointing", "position"))
TIME, PERIOD = 0.1, 0.001


def visited(keys, blend=None):
    """Weights (ticks, 3) of A, B, C over ticks in which these keys are in force."""
    blend = blend or Blend(TIME)
    found = [blend.weights(k * PERIOD, key) for k, key in enumerate(keys)]
    return np.array([[weights.get(key, 0.0) for key in (A, B, C)] for weights in found])


def wandering(ticks, seed, longest):
    """Keys of random stays of up to `longest` ticks."""
    rng, keys = np.random.default_rng(seed), []
    while len(keys) < ticks:
        keys += [(A, B, C)[rng.integers(3)]] * rng.integers(1, longest + 1)
    return keys[:ticks]


def test_after_one_change_the_weight_rises_as_the_smoothstep():
    weights = visited([A] * 10 + [B] * 150)
    s = np.clip((np.arange(160) - 10) * PERIOD / TIME, 0.0, 1.0)
    np.testing.assert_allclose(weights[:, 1], s * s * (3 - 2 * s), atol=1e-12)
    np.testing.assert_allclose(weights[:, 0], 1.0 - weights[:, 1], atol=1e-12)


@pytest.mark.parametrize("longest", [1, 7, 60, 300])
def test_however_often_it_changes_weights_are_convex_with_continuous_derivatives(longest):
    weights = visited(wandering(2000, longest, longest))
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert (weights > -1e-12).all()
    # What the kernel 6 s (1 - s) / TIME makes of anything between 0 and 1.
    rate = np.diff(weights, axis=0) / PERIOD
    assert np.abs(rate).max() <= 1.5 / TIME * 1.001
    assert np.abs(np.diff(rate, axis=0)).max() / PERIOD <= 12.0 / TIME**2 * 1.001


# One scene: the end effector on its path, the axis to the cone, a posture for the rest.

HAND, AXIS, ELBOW = (scene.TASKS[name] for name in ("position", "pointing", "avoidance 1-D"))


def blended(before, after, h_of, resolver="recursive", level="acceleration", tasks=(), **settings):
    """Change from one order to another; return stack, state, and the answer at weight `h_of`."""
    stack = Stack([*tasks, HAND, AXIS, ELBOW], level, scene.TASKS["damping"])
    q, v = scene.states(1, seed=4)[0]
    blend, solver = Blend(TIME), make(resolver, **settings)
    for t, order in ((0.0, before), (0.02, after), (0.02 + h_of * TIME, after)):
        state = scene.state_at(q, v, t)
        _, x = blend.resolve(solver, stack, state, order, stack.hierarchy(state, order))
    return stack, state, x, blend


@pytest.mark.parametrize("resolver", ["tpm", "recursive", "hcod"])
@pytest.mark.parametrize(("upper", "lower"), [((), ("position",)), (("position",), ("avoidance",))])
@pytest.mark.parametrize("entering", [True, False])
def test_one_task_that_enters_or_leaves_has_its_intermediate_desired_value(
        resolver, upper, lower, entering):
    """Lee, Mansard, Park (2012): b becomes h b + (1 - h) J x, x the answer without the task."""
    with_it, without = (*upper, "pointing", *lower), (*upper, *lower)
    orders = (without, with_it) if entering else (with_it, without)
    stack, state, x, blend = blended(*orders, h_of=0.3, resolver=resolver)
    h = blend.weight if entering else 1.0 - blend.weight
    assert 0.0 < h < 1.0
    x_without = oracle.solve(stack.hierarchy(state, without))
    levels = [list(level) for level in stack.hierarchy(state, with_it).levels()]
    J, b, _ = levels[len(upper)]
    levels[len(upper)] = [J, h * b + (1 - h) * J @ x_without]
    asked = Hierarchy.from_levels([(level[0], level[1]) for level in levels],
                                  stack.hierarchy(state, with_it).reference)
    np.testing.assert_allclose(x, oracle.solve(asked), rtol=0, atol=1e-8 * (1 + np.abs(x).max()))


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_bounds_that_both_stacks_have_on_top_are_kept(level):
    limits = JointLimits(scene.ROBOT, 10.0, PERIOD)
    for h in np.linspace(0.05, 0.95, 10):
        _, state, x, _ = blended(("joint limits", "position", "pointing"),
                                 ("joint limits", "pointing", "position"), h_of=h,
                                 resolver="hcod", level=level, tasks=[limits])
        low, up = limits.box(state, level)
        assert (low - 1e-9 <= x).all()
        assert (x <= up + 1e-9).all()
