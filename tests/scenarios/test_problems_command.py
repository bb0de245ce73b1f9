"""`hierarchy problems`: families listed, halves exported, files checked."""

import json

import numpy as np
import pytest

from scenarios.cli.main import run_command
from scenarios.problems import recorded
from scenarios.problems.answers import export, save
from scenarios.problems.families import FAMILIES, available, family
from solvers import make, problems
from solvers.problems.files import read

QUICK = ("EQ7", "INEQ7", "DEGEN7", *problems.KINDS, "recipe")


def test_a_family_without_its_package_is_left_out_and_said(monkeypatch, capsys, tmp_path):
    from scenarios.problems import families

    def distribution(name):
        if name == "example-robot-data":
            raise families.PackageNotFoundError(name)

    monkeypatch.setattr(families, "distribution", distribution)
    absent = {"singular-panda", "singular-romeo"}
    assert {one.name for one in available()} == set(FAMILIES) - absent
    assert set(families.unavailable()) == absent
    monkeypatch.setattr(families, "FAMILIES", {name: FAMILIES[name] for name in ("integers",)})
    assert run_command(["problems", "export", "all", "--count", "1", "--no-answers",
                        "--out", str(tmp_path)]) == 0
    assert ("left out: singular-panda, which needs example-robot-data: pip install "
            "'task-hierarchy[descriptions]'") in capsys.readouterr().err


@pytest.mark.parametrize("name", QUICK)
def test_halves_are_reproducible_and_never_the_same(name):
    one = family(name)
    assert one.half(3, 2).digest == one.half(3, 2).digest
    assert len({one.half(seed, 2).digest for seed in (0, 1, 2)}) == 3


def test_a_run_that_ends_before_its_window_is_an_error(monkeypatch):
    from scenarios.config import ScenarioError

    monkeypatch.setattr(recorded, "simulate", lambda *_, **__: None)
    with pytest.raises(ScenarioError, match="ellipse-limits: no run with seed 3 has 2 problems"):
        recorded.recorded("ellipse-limits", 3, 2)


def test_export_show_and_check(capsys, tmp_path):
    out = ["--seed", "4", "--count", "3"]
    assert run_command(["problems", "export", "integers", *out, "--out", str(tmp_path)]) == 0
    file = tmp_path / "integers-fresh-4.npz"
    assert file.is_file()
    assert run_command(["problems", "show", str(file)]) == 0
    assert "3 completely" in capsys.readouterr().out
    assert run_command(["problems", "show", "integers", *out, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["sha256"] == read(file).digest
    assert run_command(["problems", "show", "EQ7", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["equalities"] == "100 % of the rows"
    assert run_command(["problems", "check", str(file)]) == 0


def test_check_finds_an_answer_that_is_not_proved(capsys, tmp_path):
    file = export(family("integers"), 5, 2, True, tmp_path)
    found = read(file)
    found.answers[1].least[0] += 1.0
    save(found, tmp_path)
    assert run_command(["problems", "check", str(file)]) == 1
    assert "problem 1: level 1: least violation" in capsys.readouterr().out


def test_problems_as_others_make_them_are_what_their_makers_describe():
    for h in family("of-daqp").half(3, 5).problems:
        x = make("hcod").solve(h).x
        rows = slice(0, h.sizes[0])
        apart = np.minimum(h.upper - h.A @ x, h.A @ x - h.lower)[rows]
        assert (apart > -1e-9).all()
        assert (apart < 1e-9).sum() == 8
        assert np.linalg.cond(h.A[h.sizes[0]:]) ** 2 == pytest.approx(100.0)
    sides = [(h.lower == h.upper, np.isinf(h.lower), np.isinf(h.upper))
             for h in family("of-soth").half(3, 20).problems]
    assert all(any(kind.any() for kind in some) for some in zip(*sides, strict=True))
    ranks = [np.linalg.matrix_rank(h.A) - h.m for h in family("of-lexls").half(3, 20).problems]
    assert min(ranks) < 0
