"""Nothing of a lower task reaches an upper one, also while velocity limits are active."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmark.strictness import AIM, CutOff, able, run, strictness
from hierarchy import Hierarchy, HierarchyError
from scenarios.loop.audit import Strictness
from solvers import Resolution, make

ABLE = able()
SHORT = 0.1  # [s]; the limits are active all the time, and a cascade needs ms for a solve


@pytest.mark.slow
@pytest.mark.parametrize("resolver", [r for r in ABLE if r.strict], ids=lambda r: r.label)
def test_the_posture_does_not_move_the_end_effector(resolver):
    found = strictness(resolver, SHORT)
    assert found["at_limit_ticks"] == found["ticks"] == 100
    assert found["prevented_m"] > 1e-3
    assert found["moved_m"] < AIM
    assert found["failed"] == 0
    assert found["excess_rad_s"] < max(1e-9, resolver.accuracy)
    assert found["strict"]


@pytest.mark.slow
def test_nor_does_it_until_the_end_effector_has_arrived():
    found = strictness(make("hcod"))
    assert 0 < found["at_limit_ticks"] < found["ticks"] == 2000
    assert found["strict"]
    assert found["error_m"] < AIM


def test_every_resolver_that_handles_bounds_is_held_to_it():
    assert {"hcod", "hqp proxqp", "hqp osqp"} <= {resolver.label for resolver in ABLE}
    assert all(resolver.handles in ("bounds", "inequalities") for resolver in ABLE)


def test_an_answer_that_is_cut_off_at_its_limits_is_found_out():
    found = strictness(CutOff(), SHORT)
    assert found["moved_m"] > 1e-4
    assert not found["strict"]


def test_a_resolver_of_equalities_is_refused():
    with pytest.raises(HierarchyError, match="equalities only"):
        strictness(make("recursive"), SHORT)


def test_every_resolver_has_a_row():
    rows = run([make("hcod"), CutOff()], SHORT).rows["strictness"]
    assert [(row["entrant"], row["strict"]) for row in rows] == [("hcod", True),
                                                                 ("tpm, cut off", False)]


@pytest.mark.parametrize(("level", "moved"), [("velocity", 0.01 * 5.0),
                                              ("acceleration", 0.01**2 / 2 * 5.0)])
def test_the_way_is_that_of_a_command_held_for_one_tick(level, moved):
    """Rows 2 I, and a lower level that changes the answer by (1.5, 2): 5 in the rows' unit."""
    h = Hierarchy.from_levels([(2.0 * np.eye(2), np.zeros(2)), (np.eye(2), np.zeros(2))],
                              names=("position", "below"))
    alone = SimpleNamespace(solve=lambda upper, memory: Resolution(np.zeros(upper.n)))
    scenario = SimpleNamespace(control=SimpleNamespace(level=level, period=0.01))
    audit = Strictness(1, scenario)
    audit.look(0, SimpleNamespace(hierarchy=h, resolver=alone,
                                  resolution=Resolution(np.array([1.5, 2.0]))))
    found = audit.signals(SimpleNamespace(ticks=1))["moved_by_lower"]
    np.testing.assert_allclose(found, [moved], rtol=1e-12)
