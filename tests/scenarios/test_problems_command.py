"""`hierarchy problems`, and whether fresh problems are like the stored ones of their family."""

import re

import numpy as np
import pytest
from rank_cases import solved

from scenarios.problems import recorded
from scenarios.problems.families import FAMILIES, available, export, family, save
from scenarios.problems.made import posed
from solvers import Status, certify, make
from solvers.problems.files import Collection, Head, read


def test_a_family_without_its_package_is_left_out_and_said(monkeypatch, command, tmp_path):
    from scenarios.problems import families

    monkeypatch.setattr(families, "version_of",
                        lambda name: None if name == "example-robot-data" else "1.0")
    absent = {"singular-panda", "singular-romeo"}
    assert {one.name for one in available()} == set(FAMILIES) - absent
    assert set(families.unavailable()) == absent
    monkeypatch.setattr(families, "FAMILIES", {name: FAMILIES[name] for name in ("integers",)})
    said = command("problems export all --count 1 --no-answers --out", tmp_path).err
    assert ("left out: singular-panda, which needs example-robot-data: pip install "
            "'task-hierarchy[descriptions]'") in said


def test_a_file_without_problems_is_described(command, tmp_path):
    Collection(Head("none", "", "fresh", 1), (), ()).save(tmp_path / "none.npz")
    said = command("problems show", tmp_path / "none.npz").out
    assert re.search(r"^unknowns +none$", said, re.MULTILINE)


def test_check_finds_an_answer_that_is_not_proved(command, tmp_path):
    file = export(family("integers"), 5, 2, True, tmp_path)
    found = read(file)
    found.answers[1].least[0] += 1.0
    found.answers[0].x[0] = np.nan
    save(found, tmp_path)
    said = command("problems check", file, code=1).out
    assert "problem 0: x[0] is " in said
    assert "problem 1: level 1: least violation" in said


def test_half_of_the_stored_ticks_of_a_humanoid_meet_no_limit():
    stored = recorded.family("DYN60")
    limits = [(h.A @ x, h.lower, h.upper) for h, x in ((one.h, one.proof.x) for one in stored)]
    rooms = [np.minimum(Ax - lower, upper - Ax)[18:88].min() for Ax, lower, upper in limits]
    assert 30 <= sum(room > 1e-6 for room in rooms) <= 70
    np.testing.assert_allclose(recorded.answer(stored[0].h), stored[0].proof.x, atol=1e-6)
    assert [one.before is None for one in stored] == [p % 10 == 0 for p in range(100)]


@pytest.mark.parametrize(("name", "count"), [("singular-lwr", 24), ("singular-dual-arm", 24),
                                             ("singular-humanoid", 12)])
def test_at_singular_postures_no_limit_is_passed_and_answers_are_solved(name, count):
    """The step to the target of a nearly singular level is 1e13 rad/s long, and cut by a limit.

    Of the humanoid's, 38 of 150 with other seeds are INACCURATE; of the others 2 of 300.
    """
    solved = 0
    for h in posed(name, 26112301, count):
        res = make("hcod").solve(h)
        assert h.violations(res.x)[0] < 1e-12
        solved += res.status is Status.SOLVED
    assert solved >= count - (count // 3 if name == "singular-humanoid" else 2)


@pytest.mark.parametrize("name", ["of-pink", "of-mink", "of-placo", "of-tsid"])
def test_problems_of_other_packages_get_other_targets_with_a_seed_and_keep_rows_and_limits(name):
    public, fresh = (FAMILIES[name].half(seed, 12).problems for seed in (0, 26112682))
    for h, new in zip(public, fresh, strict=True):
        top = h.sizes[0]
        assert np.array_equal(h.A, new.A)
        assert np.array_equal(h.upper[:top], new.upper[:top])
        assert not np.array_equal(h.lower, new.lower)
        assert certify(new, solved(make("hcod"), new).x).certified
