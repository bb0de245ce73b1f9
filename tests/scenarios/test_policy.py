"""What is sent in a tick with trouble, and from one stack to the next."""

from itertools import islice, permutations

import numpy as np
import pytest
import scene

from benchmark.solve import oracle
from hierarchy import Hierarchy, Stack
from hierarchy.tasks import JointLimits
from scenarios import load
from scenarios.cell.build import build
from scenarios.config.sections.control import ControlSection
from scenarios.loop.controller import Controller
from scenarios.loop.faults import Faults
from scenarios.loop.policy import Policy
from scenarios.loop.transition import Blend, Key
from solvers import make

PERIOD = 0.001


@pytest.mark.parametrize("period", [0.001, 0.1, 1.0])
def test_braking_ends_at_rest_and_never_swings_through_it(period):
    p, v = Policy(ControlSection(level="acceleration", period=period, duration=1.0,
                                 resolver="hcod")), np.array([0.5, -1.0, 0.0])
    for _ in range(round(5.0 / period)):
        after = v + p.choose(0.0, ["stale"], 3.0 * v, v) * period
        assert (after * v >= 0.0).all()
        v = after
    assert np.abs(v).max() < 1e-9


@pytest.mark.parametrize("name", ["ellipse", "ellipse-velocity"])
def test_without_a_measurement_the_last_state_is_carried_on_by_the_commands_sent(name):
    """Otherwise a robot that brakes blind would brake from a speed it has no more."""
    c = Controller(build(load(name, ["control.damping=1.0"])))
    plant, nothing, speed = c.cell.plant, np.full(7, np.nan), 0.0
    for k in range(400):
        known = plant.q.copy(), plant.v.copy()
        x = c.command(k * PERIOD, nothing if k >= 100 else plant.q, plant.v)
        np.testing.assert_allclose(c.cell.state.q, known[0], rtol=0, atol=1e-12)
        np.testing.assert_allclose(c.cell.state.v, known[1], rtol=0, atol=1e-12)
        plant.act(x)
        speed = max(speed, np.abs(plant.v).max())
    assert speed > 0.01
    assert np.abs(plant.v).max() < 0.06 * speed


A, B, C = Key(("position",)), Key(("position", "pointing")), Key(("pointing", "position"))
TIME, TICK = 0.1, 0.001


def visited(keys):
    """Weights (ticks, 3) of A, B, C over ticks in which these keys are in force."""
    blend = Blend(TIME)
    found = [blend.weights(k * TICK, key) for k, key in enumerate(keys)]
    return np.array([[weights.get(key, 0.0) for key in (A, B, C)] for weights in found])


def test_after_one_change_the_weight_rises_as_the_smoothstep():
    weights = visited([A] * 10 + [B] * 150)
    s = np.clip((np.arange(160) - 10) * TICK / TIME, 0.0, 1.0)
    np.testing.assert_allclose(weights[:, 1], s * s * (3 - 2 * s), atol=1e-12)
    np.testing.assert_allclose(weights[:, 0], 1.0 - weights[:, 1], atol=1e-12)


@pytest.mark.parametrize("longest", [1, 7, 60, 300])
def test_however_often_it_changes_weights_are_convex_with_continuous_derivatives(longest):
    rng, keys = np.random.default_rng(longest), []
    while len(keys) < 2000:  # stays of up to `longest` ticks
        keys += [(A, B, C)[rng.integers(3)]] * rng.integers(1, longest + 1)
    weights = visited(keys)
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, atol=1e-12)
    assert (weights > -1e-12).all()
    # What the kernel 6 s (1 - s) / TIME makes of anything between 0 and 1.
    rate = np.diff(weights, axis=0) / TICK
    assert np.abs(rate).max() <= 1.5 / TIME * 1.001
    assert np.abs(np.diff(rate, axis=0)).max() / TICK <= 12.0 / TIME**2 * 1.001


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


def test_stacks_that_agree_have_their_answer_however_many_are_blended():
    """More than are resolved, so that the weights of those that are do not sum to one."""
    tasks, blend = [HAND, AXIS, ELBOW, scene.TASKS["coupling"]], Blend(TIME)
    stack = Stack(tasks, "acceleration", scene.TASKS["damping"])
    q, v = scene.states(1, seed=4)[0]
    for k, order in enumerate(islice(permutations(stack.names), 12)):
        state = scene.state_at(q, v, 0.008 * k)
        h = stack.hierarchy(state, order)
        own, x = blend.resolve(make("tpm"), stack, state, order, h)
        np.testing.assert_allclose(x, oracle.solve(h), rtol=0, atol=1e-8 * np.abs(x).max())
        assert (blend.weight == 1.0) == (x is own.x) == (k == 0)


@pytest.mark.parametrize("level", ["velocity", "acceleration"])
def test_bounds_that_both_stacks_have_on_top_are_kept(level):
    limits = JointLimits(scene.ROBOT, 10.0, TICK)
    for h in np.linspace(0.05, 0.95, 10):
        _, state, x, _ = blended(("joint limits", "position", "pointing"),
                                 ("joint limits", "pointing", "position"), h_of=h,
                                 resolver="hcod", level=level, tasks=[limits])
        low, up = limits.box(state, level)
        assert ((low - 1e-9 <= x) & (x <= up + 1e-9)).all()


@pytest.mark.parametrize(("name", "fault", "joint", "spoiled"), [
    ("ellipse", "nan_position", 3, 2), ("ellipse", "nan_velocity", 7, 6),
    ("humanoid", "nan_position", 2, 8), ("humanoid", "nan_velocity", 2, 7)])
def test_a_fault_of_a_joint_spoils_its_number_alone(name, fault, joint, spoiled):
    scenario = load(name, [f"faults=[{{kind='{fault}', at=0.0, duration=0.1, joint={joint}}}]"])
    measured = Faults(build(scenario)).measure(0.0)[fault == "nan_velocity"]
    assert np.flatnonzero(np.isnan(measured)).tolist() == [spoiled]
