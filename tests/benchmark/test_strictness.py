"""Nothing of a lower task reaches an upper one, also while velocity limits are active."""

import pytest

from benchmark.strictness import entrants, run
from solvers import make

ENTRANTS = {one.label: one for one in entrants()}
FEW = ("hcod", "sns optimal", "hqp proxqp", "weighted", "tpm, cut off")  # each in a process
SHORT = 0.1  # [s]; the limits are active all the time, and a cascade needs ms for a solve


@pytest.mark.slow
def test_the_posture_moves_the_end_effector_only_where_levels_are_not_strict():
    found = run([ENTRANTS[label] for label in FEW], SHORT)
    rows = {row["entrant"]: row for row in found.rows["strictness"]}
    assert tuple(rows) == FEW
    for label, found in rows.items():
        options = dict(ENTRANTS[label].options)
        resolver = make(options.pop("resolver"), **options) if options else None
        if resolver is None or not resolver.strict:
            continue
        assert found["strict"], label
        assert found["at_limit_ticks"] == found["ticks"] == 100
        assert found["prevented_m"] > 1e-3
        assert found["excess_rad_s"] < max(1e-9, resolver.accuracy)
    assert rows["tpm, cut off"]["moved_m"] > 1e-4
    assert not rows["tpm, cut off"]["strict"]
