"""Nothing of a lower task reaches an upper one, also while velocity limits are active."""


import pytest

from benchmark.strictness import AIM, CutOff, able, run, strictness
from solvers import make

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


def test_every_resolver_has_a_row():
    rows = run([make("hcod"), CutOff()], SHORT).rows["strictness"]
    assert [(row["entrant"], row["strict"]) for row in rows] == [("hcod", True),
                                                                 ("tpm, cut off", False)]
