"""What is sent in a tick with trouble, and from one stack to the next."""

import numpy as np
import pytest
import scene

from benchmark.solve import oracle
from hierarchy import Hierarchy, Stack
from scenarios import load
from scenarios.cell.build import build
from scenarios.config.sections.control import ControlSection
from scenarios.loop.faults import Faults
from scenarios.loop.policy import Policy
from scenarios.loop.transition import Blend
from solvers import make


@pytest.mark.parametrize("period", [0.001, 0.1, 1.0])
def test_braking_ends_at_rest_and_never_swings_through_it(period):
    p, v = Policy(ControlSection(level="acceleration", period=period, duration=1.0,
                                 resolver="hcod")), np.array([0.5, -1.0, 0.0])
    for _ in range(round(5.0 / period)):
        after = v + p.choose(0.0, ["stale"], 3.0 * v, v) * period
        assert (after * v >= 0.0).all()
        v = after
    assert np.abs(v).max() < 1e-9


@pytest.mark.parametrize("resolver", ["tpm", "recursive", "hcod"])
@pytest.mark.parametrize(("upper", "lower"), [((), ("position",)), (("position",), ("avoidance",))])
@pytest.mark.parametrize("entering", [True, False])
def test_one_task_that_enters_or_leaves_has_its_intermediate_desired_value(
        resolver, upper, lower, entering):
    """Lee, Mansard, Park (2012): b becomes h b + (1 - h) J x, x the answer without the task."""
    with_it, without = (*upper, "pointing", *lower), (*upper, *lower)
    orders = (without, with_it) if entering else (with_it, without)
    stack = Stack([scene.TASKS[name] for name in ("position", "pointing", "avoidance 1-D")],
                  "acceleration", scene.TASKS["damping"])
    blend, (q, v) = Blend(0.1), scene.states(1, seed=4)[0]
    for t, order in ((0.0, orders[0]), (0.02, orders[1]), (0.05, orders[1])):
        state = scene.state_at(q, v, t)
        _, x = blend.resolve(make(resolver), stack, state, order, stack.hierarchy(state, order))
    h = blend.weight if entering else 1.0 - blend.weight
    assert 0.0 < h < 1.0
    x_without = oracle.solve(stack.hierarchy(state, without))
    levels = [list(level) for level in stack.hierarchy(state, with_it).levels()]
    J, b, _ = levels[len(upper)]
    levels[len(upper)] = [J, h * b + (1 - h) * J @ x_without]
    asked = Hierarchy.from_levels([(level[0], level[1]) for level in levels],
                                  stack.hierarchy(state, with_it).reference)
    np.testing.assert_allclose(x, oracle.solve(asked), rtol=0, atol=1e-8 * (1 + np.abs(x).max()))


@pytest.mark.parametrize(("name", "fault", "joint", "spoiled"), [
    ("ellipse", "nan_position", 3, 2), ("ellipse", "nan_velocity", 7, 6),
    ("humanoid", "nan_position", 2, 8), ("humanoid", "nan_velocity", 2, 7)])
def test_a_fault_of_a_joint_spoils_its_number_alone(name, fault, joint, spoiled):
    scenario = load(name, [f"faults=[{{kind='{fault}', at=0.0, duration=0.1, joint={joint}}}]"])
    measured = Faults(build(scenario)).measure(0.0)[fault == "nan_velocity"]
    assert np.flatnonzero(np.isnan(measured)).tolist() == [spoiled]
