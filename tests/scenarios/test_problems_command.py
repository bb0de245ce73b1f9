"""`hierarchy problems`, and whether fresh problems are like the stored ones of their family."""

import re

import numpy as np
import pytest
from rank_cases import solved

from hierarchy import Hierarchy
from scenarios.problems import recorded
from scenarios.problems.families import FAMILIES, available, export, family, save
from scenarios.problems.made import posed
from solvers import Status, certify, make, problems
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


def test_ticks_of_the_humanoid_are_ten_in_a_row_after_its_push_of_runs_that_last(monkeypatch):
    asked = []

    def window(scenario, first, count):
        asked.append((scenario.control.period * first, scenario.plant, scenario.limits.horizon))
        return [Hierarchy.from_levels(
            [(np.eye(3)[:1], [k]), (np.eye(3)[:2], [7.0, 7.0]), (np.eye(3)[2:], [1.0])],
            names=("a", recorded.LEFT_OUT, "b")) for k in range(count - (len(asked) == 2))]

    monkeypatch.setattr(recorded, "window", window)
    found = recorded.fresh("DYN60", 60, 12)
    assert [one.h.names for one in found] == [("a", "b")] * 12
    assert [[*one.proof.x.round(9), one.proof.complete] for one in found] == [
        [k % 10, 0.0, 1.0, True] for k in range(12)]
    assert [one.before is found[k - 1].h for k, one in enumerate(found)] == [
        k not in (0, 10) for k in range(12)]
    assert len({at for at, *_ in asked}) == len(asked) == 3
    for at, plant, horizon in asked:
        assert 0.3 <= at < 1.0
        assert not any((plant.stops, horizon, plant.joint_friction, plant.joint_damping,
                        plant.armature))


def test_a_window_begins_at_the_tick_of_its_seed_in_the_first_run_that_lasts(monkeypatch):
    asked = []

    def window(scenario, first, count):
        asked.append((first, tuple(scenario.start.q)))
        return [None] * (count - (len(asked) in (2, 3)))

    monkeypatch.setattr(recorded, "window", window)
    for seed in (0, 3, 4):
        assert recorded.recorded("ellipse-limits", seed, 2) == [None, None]
    assert [first for first, _ in asked] == [7540, 3047, 3047, 3047, 9393]
    assert len({q for _, q in asked}) == 5


def test_a_run_that_ends_before_its_window_is_an_error(monkeypatch):
    from scenarios.config import ScenarioError

    monkeypatch.setattr(recorded, "uninterrupted", lambda *_, **__: None)
    with pytest.raises(ScenarioError, match="ellipse-limits: no run with seed 3 has 2 problems"):
        recorded.recorded("ellipse-limits", 3, 2)


def test_check_finds_an_answer_that_is_not_proved(command, tmp_path):
    file = export(family("integers"), 5, 2, True, tmp_path)
    found = read(file)
    found.answers[1].least[0] += 1.0
    found.answers[0].x[0] = np.nan
    save(found, tmp_path)
    said = command("problems check", file, code=1).out
    assert "problem 0: x[0] is " in said
    assert "problem 1: level 1: least violation" in said


def test_problems_as_others_make_them_are_what_their_makers_describe():
    for h in family("of-daqp").half(3, 5).problems:
        x = make("hcod").solve(h).x
        apart = np.minimum(h.upper - h.A @ x, h.A @ x - h.lower)[:h.sizes[0]]
        assert (apart > -1e-9).all()
        assert (apart < 1e-9).sum() == 8
        assert np.linalg.cond(h.A[h.sizes[0]:]) ** 2 == pytest.approx(100.0)
    sides = [(h.lower == h.upper, np.isinf(h.lower), np.isinf(h.upper))
             for h in family("of-soth").half(3, 20).problems]
    assert all(any(kind.any() for kind in some) for some in zip(*sides, strict=True))
    ranks = [np.linalg.matrix_rank(h.A) - h.m for h in family("of-lexls").half(3, 20).problems]
    assert min(ranks) < 0


@pytest.mark.parametrize("name", problems.FAMILIES)
def test_sizes_equalities_norms_of_rows_and_ranks_are_those_of_the_stored_problems(name):
    stored = [problem.h for problem in recorded.family(name)]
    fresh = [problems.family(name, seed) for seed in range(40)]
    for h in fresh:
        assert h.sizes.tolist() == stored[0].sizes.tolist()
        assert np.array_equal(h.lower == h.upper, stored[0].lower == stored[0].upper)
    expected, found = (np.mean([np.linalg.norm(h.A, axis=1) for h in made], axis=0)
                       for made in (stored, fresh))
    np.testing.assert_allclose(found, expected, atol=0.35 * expected.max())
    assert {ranks(h) for h in fresh} <= {ranks(h) for h in stored}


def test_half_of_the_stored_ticks_of_a_humanoid_meet_no_limit():
    stored = recorded.family("DYN60")
    limits = [(h.A @ x, h.lower, h.upper) for h, x in ((one.h, one.proof.x) for one in stored)]
    rooms = [np.minimum(Ax - lower, upper - Ax)[18:88].min() for Ax, lower, upper in limits]
    assert 30 <= sum(room > 1e-6 for room in rooms) <= 70
    np.testing.assert_allclose(recorded.answer(stored[0].h), stored[0].proof.x, atol=1e-6)
    assert [one.before is None for one in stored] == [p % 10 == 0 for p in range(100)]


def ranks(h):
    return tuple(int(np.linalg.matrix_rank(A, tol=1e-7)) for A, *_ in h.levels())


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
