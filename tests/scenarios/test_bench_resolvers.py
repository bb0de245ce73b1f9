"""The benchmark of resolvers: everybody asked, every answer judged, nothing cut off."""

import csv
import json

import cascade
import numpy as np
import pytest

from hierarchy import HierarchyError
from scenarios.bench import candidates, families, machine, resolvers
from scenarios.bench.families import family
from scenarios.cli.main import run_command
from solvers import Status
from solvers.qp import backends

pytestmark = pytest.mark.slow


@pytest.fixture
def few(monkeypatch):
    """Only two problems a family, since one cascade takes 40 ms for one of them."""
    monkeypatch.setattr(resolvers, "family", lambda name, folder: family(name, folder)[:2])


def test_a_row_for_everybody_and_every_family(few, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    rows = resolvers.run(tmp_path, seconds=0.0)
    known = {row["resolver"] for row in rows}
    assert known == expected_labels()
    equalities = {candidates.NUMPY, "augmented", "recursive", "reverse", "sns", "tpm",
                  "tpm-published"}
    assert {(row["family"], row["resolver"]) for row in rows} == {
        (name, label) for name in families.FAMILIES for label in known
        if label not in equalities or name in families.EQUALITIES}
    for row in rows:
        if row["resolver"].startswith(("hqp", "hcod")) or row["resolver"] in ("tpm", "recursive"):
            assert row["wrong"] == 0, row
            certified = round(row["certified"] * row["problems"])
            if row["family"] == "DEGEN7" and row["resolver"].startswith("hqp"):
                # ill-posed levels, on which the certificate may not follow a backend
                assert certified <= row["problems"] - row["unsolved"]
            else:
                assert certified == row["problems"] - row["unsolved"]
    with (tmp_path / "resolvers.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    assert {path.name for path in tmp_path.iterdir()} == {
        "resolvers.csv", "machine.json", "time-accuracy.svg", "time-accuracy.png"}
    assert "processor" in json.loads((tmp_path / "machine.json").read_text())
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert "…" not in out


def expected_labels():
    """Labels of everyone who can be timed with the backends that are installed."""
    there = [name for name in backends.BACKENDS if backends.installed(name)]
    warm = [f"hqp {name}" for name in there if name in ("proxqp", "osqp", "daqp")]
    return {candidates.NUMPY, "augmented", "hcod", "recursive", "reverse", "sns", "tpm",
            "tpm-published", "weighted", "hcod warm", "weighted warm",
            *(f"hqp {name}" for name in there), *(f"{label} warm" for label in warm),
            *([candidates.DAQP] if "daqp" in there else [])}


def test_times_are_given_by_median_and_tail():
    runner = resolvers._Timed(candidates.candidates()[0][0], [], iterations=[1],
                              times=[1000 * i for i in range(1, 102)])
    row = resolvers._row(runner, 1, {})
    assert (row["solves"], row["median_us"], row["p95_us"]) == (101, 51.0, 96.0)


def test_the_share_that_each_backend_solves_is_counted(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(cascade, "family", lambda name: family(name)[:2])
    rows = cascade.run(("EQ7", "INEQ7"))
    assert len(rows) == 2 * 2 * len(backends.BACKENDS)
    assert all(row["largest_error"] <= 10.0 * row["accuracy"] for row in rows)
    assert all(row["solved"] == 1.0 for row in rows if row["family"] == "EQ7")
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert "…" not in out


def test_a_backend_that_is_not_installed_is_named_and_not_skipped_silently(monkeypatch):
    monkeypatch.setattr(candidates, "installed", lambda name: name != "daqp")
    field, missing = candidates.candidates()
    assert missing["hqp daqp"] == missing["DAQP by hand"] == "pip install 'task-hierarchy[qp]'"
    assert not {"hqp daqp", "hqp daqp warm", "DAQP by hand"} & {one.label for one in field}


def test_a_warm_start_comes_from_targets_moved_by_a_percent():
    for name in ("EQ7", "INEQ7"):
        h = family(name)[0].h
        moved = candidates.moved(h)
        finite = np.isfinite(h.lower)
        np.testing.assert_allclose(moved.lower[finite], h.lower[finite], rtol=0.01)
        assert (moved.lower <= moved.upper).all()
        assert not np.array_equal(moved.lower, h.lower)
        assert moved.is_equality == h.is_equality


@pytest.mark.skipif(not backends.installed("daqp"), reason="DAQP is an extra")
def test_the_call_made_by_hand_solves_what_it_is_timed_on():
    """Where no rows conflict, and to what its finite weight allows."""
    daqp = next(one for one in candidates.candidates()[0] if one.label == candidates.DAQP)
    for problem in family("INEQ7")[:10]:
        call = daqp.prepare(problem.h, None)
        call()
        res = daqp.read(call())
        assert res.status is Status.SOLVED
        assert abs(problem.h.violations(res.x) - problem.norms).max() < 1e-5


def test_its_flag_is_read_before_its_answer():
    x = np.array([1.0, np.nan])
    res = candidates._read_daqp((x, 0.0, 1, {"iterations": 3}))
    assert res.status is Status.BACKEND_FAILURE
    assert not res.x.any()


def test_fresh_problems_are_timed_and_reported_apart(few, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    rows = resolvers.run(seconds=0.0, families=("EQ7", "INEQ7"), seed=10_000_000, count=4)
    assert {(row["family"], row["origin"], row["problems"]) for row in rows} == {
        (name, origin, count) for name in ("EQ7", "INEQ7")
        for origin, count in (("known", 2), ("fresh", 4))}
    assert all(row["wrong"] == 0 for row in rows if row["resolver"] in ("hcod", "hcod warm"))
    out = capsys.readouterr().out
    assert "INEQ7, fresh" in out
    assert out.index("known INEQ7") < out.index("fresh INEQ7")
    assert max(map(len, out.splitlines())) <= 80


def test_fresh_problems_are_not_the_stored_ones_and_some_have_norms():
    made = families.fresh("INEQ7", 10_000_000, 4, checked=2)
    assert [problem.known for problem in made] == [True, True, False, False]
    stored = [problem.h.upper for problem in family("INEQ7")]
    assert not any(np.array_equal(one.h.upper, old) for one in made for old in stored)


def test_timing_on_one_core_gives_the_others_back():
    import os

    before = os.sched_getaffinity(0)
    with machine.one_core():
        assert len(os.sched_getaffinity(0)) == 1
    assert os.sched_getaffinity(0) == before


def test_a_benchmark_without_its_problems_says_where_they_are(tmp_path):
    with pytest.raises(HierarchyError, match="tests/data/hlsp of a source checkout"):
        resolvers.run(folder=tmp_path)


def test_only_the_families_and_resolvers_asked_for_are_timed_beside_the_yardsticks(few):
    rows = resolvers.run(seconds=0.0, families=["EQ7"], resolvers=["hcod", "tpm"])
    assert {row["family"] for row in rows} == {"EQ7"}
    assert [row["resolver"] for row in rows] == [candidates.NUMPY, candidates.DAQP, "hcod", "tpm",
                                                 "tpm-published", "hcod warm"]


@pytest.mark.parametrize(("asked", "says"), [
    (["--family", "EQ8"], "unknown family 'EQ8'; did you mean 'EQ7'"),
    (["--resolver", "hqod"], "unknown resolver 'hqod'; did you mean 'hcod'"),
])
def test_an_unknown_family_or_resolver_is_named(asked, says, tmp_path, capsys):
    assert run_command(["bench", "resolvers", *asked, "--out", str(tmp_path / "out")]) == 2
    assert says in capsys.readouterr().err
