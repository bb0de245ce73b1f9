"""`hierarchy problems`: families listed, halves exported, files checked."""

import json
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from scenarios.cli.main import run_command
from scenarios.problems import answers, recorded
from scenarios.problems.answers import export, save
from scenarios.problems.families import FAMILIES, available, family
from solvers import problems
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


@pytest.mark.parametrize("name", ["singular-lwr", "singular-dual-arm", "singular-humanoid"])
def test_postures_are_singular_or_close_to_it_or_neither(name):
    kept = [smallest(h) for h in family(name).half(1, 12).problems]
    singular, near, other = (np.array(kept[kind::3]) for kind in range(3))
    assert (singular < 1e-12).all()
    assert (near > 1e-12).all()
    assert np.median(near) < 0.1 * np.median(other)


def smallest(h):
    """The smallest singular value of the tasks between the limits and the posture."""
    between = slice(int(h.offsets[1]), int(h.offsets[-2]))
    return np.linalg.svd(h.A[between], compute_uv=False)[-1]


@pytest.mark.slow
def test_a_sequence_with_a_plant_is_as_long_as_asked_and_has_consecutive_ticks():
    pytest.importorskip("mujoco")
    made = family("stand-push").half(3, 4)
    assert (len(made.problems), made.head.sequence, made.head.period) == (4, True, 0.001)
    levels = [h.names for h in made.problems]
    assert levels[0][0] == "physics"
    assert levels == levels[:1] * 4
    steps = [abs(after.A - before.A).max() for before, after in pairwise(made.problems)]
    assert 0.0 < max(steps) < 0.1


def test_a_run_that_ends_before_its_window_is_an_error(monkeypatch):
    from scenarios.config import ScenarioError

    monkeypatch.setattr(recorded, "simulate", lambda *_, **__: None)
    with pytest.raises(ScenarioError, match="ellipse-limits: no run with seed 3 has 2 problems"):
        recorded.recorded("ellipse-limits", 3, 2)


def test_list_names_every_family(capsys):
    assert run_command(["problems", "list", "--json"]) == 0
    groups = json.loads(capsys.readouterr().out)
    assert {name for group in groups.values() for name in group} == set(FAMILIES)


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


def test_of_answers_without_a_whole_proof_the_one_that_is_proved_furthest_is_taken(monkeypatch):
    proofs = [SimpleNamespace(complete=False, judged=judged) for judged in (1, 3, 2)]
    monkeypatch.setattr(answers, "_candidates", lambda _: proofs)
    monkeypatch.setattr(answers, "prove", lambda _, candidates: candidates[0])
    assert answers.answer(None) is proofs[1]
    proofs[2].complete = True
    assert answers.answer(None) is proofs[2]
