"""Nothing of a lower task reaches an upper one, also while velocity limits are active."""

import csv

import pytest

from hierarchy import HierarchyError
from scenarios.bench.strictness import AIM, CutOff, able, run, strictness
from solvers import make

ABLE = able()
SHORT = 0.1  # [s]; the limits are active all the time, and a cascade needs ms for a solve


@pytest.mark.parametrize("resolver", [r for r in ABLE if r.strict], ids=lambda r: r.label)
def test_the_posture_does_not_move_the_end_effector(resolver):
    found = strictness(resolver, SHORT)
    assert found.limited == found.ticks == 100
    assert found.missed > 1e-3
    assert found.largest < AIM
    assert found.failed == 0
    assert found.excess < max(1e-9, resolver.accuracy)
    assert found.met


def test_nor_does_it_until_the_end_effector_has_arrived():
    found = strictness(make("hcod"))
    assert 0 < found.limited < found.ticks == 2000
    assert found.met
    assert found.error < AIM
    assert found.error_alone < AIM


def test_every_resolver_that_handles_bounds_is_held_to_it():
    assert {"hcod", "hqp proxqp", "hqp osqp"} <= {resolver.label for resolver in ABLE}
    assert all(resolver.handles in ("bounds", "inequalities") for resolver in ABLE)


def test_an_answer_that_is_cut_off_at_its_limits_is_found_out():
    found = strictness(CutOff(), SHORT)
    assert found.largest > 1e-4
    assert not found.met


def test_a_resolver_of_equalities_is_refused():
    with pytest.raises(HierarchyError, match="equalities only"):
        strictness(make("recursive"), SHORT)


def test_the_table_has_a_row_and_the_file_a_line_for_each(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    found = run(tmp_path, [make("hcod"), CutOff()], SHORT)
    assert [one.label for one in found] == ["hcod", "tpm, cut off"]
    with (tmp_path / "strictness.csv").open() as file:
        assert [row["label"] for row in csv.DictReader(file)] == ["hcod", "tpm, cut off"]
    said = capsys.readouterr().out
    assert "not with tpm, cut off" in " ".join(said.split())
    assert max(map(len, said.splitlines())) <= 80
