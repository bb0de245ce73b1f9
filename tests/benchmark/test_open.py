"""The open benchmark: what it makes of entrants, how it judges, what it prints and draws."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from unittest import mock

import numpy as np
import pytest
from c_library import COMPILER

from benchmark import solve
from benchmark.packages import OWN, Entrant
from benchmark.process import CRASHED, HUNG, LEFT_OUT, Field
from benchmark.solve import judge as judging
from benchmark.solve import open as opened
from benchmark.solve import resolvers, views
from benchmark.solve.entrants import chosen, compiled
from benchmark.worker import Repeats
from hierarchy import Hierarchy, HierarchyError
from solvers import make
from solvers.problems.files import Collection, Head, read
from solvers.proof import prove

HELPERS = Path(__file__).parents[1] / "helpers"
SOLVE = Path(solve.__file__).parent


def simple(side):
    """x1 = side, then x2 <= 1 against x2 = 2: the least violations are 0, 0 and 1."""
    return Hierarchy.from_levels([([[1.0, 0.0]], [side]), ([[0.0, 1.0]], [-np.inf], [1.0]),
                                  ([[0.0, 2.0]], [4.0])])


def collection(problems, sequence=False):
    answers = tuple(prove(h, [np.linalg.lstsq(h.A, np.where(np.isfinite(h.lower), h.lower, 0.0))[0],
                              [h.lower[0], 1.0]]) for h in problems)
    return Collection(Head("simple", "for tests", "fresh", 7, sequence, 0.001 * sequence),
                      tuple(problems), answers)


@pytest.fixture(scope="module")
def equalities(tmp_path_factory):
    """Problems of one level, whose first sides are 0 to 4."""
    file = tmp_path_factory.mktemp("problems") / "simple.npz"
    collection([Hierarchy.from_levels([(np.eye(2), [float(side), 1.0])])
                for side in range(5)]).save(file)
    return file


def fake(name, **options):
    return Entrant(name, OWN, f"{HELPERS / 'fake_entrants.py'}:{name}", options)


@pytest.mark.parametrize(("name", "limit", "most", "expected"), [
    ("Crashing", 10.0, 5, [None, None, CRASHED, None, None]),
    ("Hanging", 0.3, 5, [None, None, HUNG, None, None]),
    ("Doomed", 10.0, 2, [CRASHED, CRASHED, LEFT_OUT, LEFT_OUT, LEFT_OUT])])
def test_an_end_costs_one_problem_and_too_many_the_rest_of_a_file(
        equalities, monkeypatch, name, limit, most, expected):
    monkeypatch.setattr(opened, "MOST_ENDS", most)
    with Field([fake(name), fake("LeastSquares")], opened.QUESTIONS) as field:
        first, second = (opened.asked(field, equalities, limit) for _ in range(2))
    assert [row["x"][0] for row in second["LeastSquares"]] == pytest.approx([0, 1, 2, 3, 4])
    first, second = first[name], second[name]
    assert [row.get("ended") for row in first] == [row.get("ended") for row in second] == expected
    assert (first[0]["version"], [row["problem"] for row in first]) == ("fake 1", [0, 1, 2, 3, 4])
    if expected[4] is None:
        assert second[4]["x"] == pytest.approx([4.0, 1.0])
    assert all("code" in row["why"] for row in first if row.get("ended") == CRASHED)


@pytest.mark.skipif(COMPILER is None, reason="no compiler of C")
@pytest.mark.skipif(sys.platform != "linux", reason="the C library is made on Linux")
def test_our_c_library_answers_behind_the_header_as_python_does(folder, tmp_path):
    """The worked example of solver.h; tpm refuses inequalities beyond bounds."""
    made = collection([simple(side) for side in (1.0, 2.0, 3.0)], sequence=True)
    made.save(tmp_path / "simple.npz")
    rows = {}
    for resolver in ("hcod", "tpm"):
        out = tmp_path / f"{resolver}.so"
        subprocess.run([COMPILER, "-O2", "-fPIC", "-shared", f"-I{SOLVE}", SOLVE / "library.c",
                        f"-DSOLVE=th_solve_{resolver}", f"-I{folder / 'include'}",
                        folder / "lib" / "libtask_hierarchy.a", "-lm", "-o", out], check=True)
        with Field(compiled([out], ["ours"]), opened.QUESTIONS) as field:
            rows[resolver] = opened.asked(field, tmp_path / "simple.npz")["ours"]
    assert {row["refused"] for row in rows["tpm"]} == {"not for this solver"}
    found = judging.judge(rows["hcod"], {made.digest: made})
    assert [row["verdict"] for row in found] == [judging.SOLVED] * 3
    assert [row["warm_right"] for row in found] == [None, True, True]
    for h, row in zip(made.problems, rows["hcod"], strict=True):
        res = make("hcod").solve(h)
        assert (row["x"], row["iterations"]) == (res.x.tolist(), res.iterations)
        assert re.fullmatch("ours, SHA-256 [0-9a-f]{12}", row["version"])
        assert 1 <= len(row["cold_inside_ns"]) <= Repeats().most
        assert 0 <= min(row["cold_inside_ns"]) < min(row["cold_ns"])
    assert max(row["warm_iterations"] for row in rows["hcod"][1:]) < rows["hcod"][0]["iterations"]


def raw(x, collected, problem=0, solved=True, **more):
    return {"entrant": "one", "version": "1", "family": "simple", "half": "fresh", "seed": 7,
            "sha256": collected.digest, "problem": problem, "solved": solved, "same": True,
            "x": None if x is None else list(map(float, x)), "cold_ns": [1000, 3000, 2000], **more}


def found(x, solved=True, **more):
    one = collection([simple(3.0)])
    return judging.judge([raw(x, one, solved=solved, **more)], {one.digest: one})[0]


@pytest.mark.parametrize(("x", "solved", "verdict", "level"), [
    ([3.0, 1.0], True, judging.SOLVED, -1), ([3.0, 1.0], False, judging.MODEST, -1),
    ([3.0 + 1e-7, 1.0], True, judging.SOLVED, -1), ([3.1, 1.0], True, judging.WRONG, 0),
    ([3.0, 1.5], True, judging.WRONG, 1), ([3.0, 0.5], True, judging.WRONG, 2),
    ([3.0, 0.5], False, judging.FAILED, 2), ([np.nan, 1.0], True, judging.WRONG, 0),
    ([3.0], True, judging.WRONG, 0)])
def test_only_x_decides_whether_an_answer_is_right(x, solved, verdict, level):
    one = found(x, solved)
    assert (one["verdict"], one["level"]) == (verdict, level)
    if x == [3.0, 0.5]:  # |2 * 0.5 - 4| beyond 2
        assert (one["absolute"], one["relative"]) == pytest.approx((1.0, 0.5 / (1.0 + 10.0**0.5)))


@pytest.mark.parametrize("x", [[3.0], [[3.0], [1.0]], 3.0])
def test_an_answer_of_another_shape_is_wrong_and_stops_no_report(x):
    one = collection([simple(3.0)] * 2, sequence=True)
    rows = [{**raw(None, one, p), "x": x, "without": [3.0]} for p in (0, 1)]
    rows = judging.judge(rows, {one.digest: one})
    assert [row["verdict"] for row in rows] == [judging.WRONG] * 2
    assert np.isnan(judging.summary(rows, {"simple": 2.0})["moved"])


@pytest.mark.parametrize(("more", "verdict"), [
    ({"ended": CRASHED}, judging.CRASHED), ({"ended": HUNG}, judging.HUNG),
    ({"ended": LEFT_OUT}, judging.CRASHED), ({"refused": "no"}, judging.REFUSED),
    ({"raised": "Error"}, judging.RAISED)])
def test_what_is_not_answered_has_its_own_verdict(more, verdict):
    assert found(None, **more)["verdict"] == verdict


def test_a_summary_counts_and_takes_the_worst_of_what_is_called_solved():
    one = collection([simple(3.0), simple(1.0)], sequence=True)
    rows = judging.judge([raw([3.0, 1.0], one), raw([1.5, 1.0], one, 1)], {one.digest: one})
    whole = judging.summary(rows, {"simple": 2.0})
    assert (whole["right"], whole["wrong"], whole["answered"]) == (0.5, 1, 2)
    assert whole["absolute"] == pytest.approx(0.5)
    assert whole["rough"] == pytest.approx(0.75)  # 1.5 where the proved answers move by 2
    assert (whole["median_us"], whole["most_us"]) == (2.0, 3.0)
    assert np.isnan(whole["warm_median_us"])
    assert np.isnan(judging.summary([found(None, refused="no", start_kib=1000)])["memory_mb"])


def test_steps_to_an_answer_that_is_not_finite_are_no_steps():
    points = [np.array([np.inf]), np.array([np.inf]), None, np.zeros(1), np.ones(1), np.ones(2)]
    assert judging._step(points) == judging._step(points[::-1]) == 1.0
    assert np.isnan(judging._step(points[:4]))


def test_the_best_may_lack_a_family_that_another_was_asked_later():
    def row(name, family, asked, right):
        return {"entrant": name, "family": family, "asked": asked, "right": right, "median_us": 1.0}

    total = [row("best", "", 100, 1.0), row("other", "", 102, 0.5)]
    some = [row("best", "a", 100, 1.0), row("other", "a", 100, 0.5), row("other", "b", 2, 0.5)]
    for refused in ([], [row("best", "b", 0, np.nan)]):
        assert "More often right than best: none." in views.lead("", total, [*some, *refused])
    of = row("equalities", "a", 0, np.nan), row("best", "a", 100, 0.9), row("other", "a", 100, 1.0)
    assert "More often right than best: a (other, 100% against 90.0%)." in views.lead("", total, of)


def test_a_set_that_nobody_can_be_asked_has_its_tables():
    section, _ = views.section("a", [found(None, refused="no", start_kib=0)], {}, {})
    assert section.tables[0].cells()[0] == ("one", ["0", "–", "0", "0", "0", "0", "0"])
    assert not section.figures


@pytest.mark.parametrize("asked", [[], ["one"]])
def test_borders_may_lack_what_was_asked_later(asked):
    rows = [found([3.0, 1.0], entrant=name, start_kib=0) for name in ("one", "later")]
    at = {border: [row for row in rows if row["entrant"] in asked] for border in (1e-9, 1e-8)}
    section, _ = views.section("a", rows, {}, at)
    assert ("a: right over border" in section.figures) == bool(asked)


@pytest.mark.parametrize(("call", "said"), [
    (lambda: chosen([], more=[fake("hcod")]), "two entrants are named hcod"),
    (lambda: chosen([f"{HELPERS / 'fake_entrants.py'}:Moody"], more=[fake("Moody")]),
     "two entrants are named Moody"),
    (lambda: compiled([Path("a.so")], []), "1 libraries and 0 names"),
    (lambda: compiled([Path("a.so")], ["a"]), r"a\.so does not exist"),
    (lambda: chosen(["hcodd"]), "did you mean 'hcod'"),
    (lambda: chosen(["hcod"], "python9"), "--python python9 is for entrants FILE"),
    (lambda: resolvers.run(count=3), "--count is of fresh problems"),
    (lambda: chosen(["no/such/file.py:Mine"]), "does not exist")])
def test_an_entrant_that_is_not_there_is_refused(call, said):
    with pytest.raises(HierarchyError, match=said):
        call()


def test_the_command_runs_continues_and_writes_its_page(tmp_path, command, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("scenarios.draw.figures.drawing.write", mock.Mock())  # the page has them
    out = tmp_path / "open"
    line = ("bench open --family integers --family one_unknown --count 3 --public 2 --fresh 9 "
            "--borders --entrant hcod --out", out)
    with mock.patch("benchmark.report.Report.write"):  # whose figures take the most time
        first_said = command(*line).err
    first = {file: file.stat().st_mtime_ns for file in out.glob("*/*.*")}
    assert len(first) == 8  # four files of problems, four of rows
    assert len(list(out.glob("borders/*/*.npz"))) == 4 * 8
    (out / "missing.json").write_text('{"absent": "not installed", "Moody": "not installed"}')
    said = command(*line, "--count", 4, "--entrant", f"{HELPERS / 'fake_entrants.py'}:Moody")
    assert "integers-fresh-9 has 3 problems, not 4: they stay as they are" in said.err
    missing = json.loads((out / "missing.json").read_text())
    assert (missing["absent"], "Moody" in missing) == ("not installed", False)
    assert first.items() <= {file: file.stat().st_mtime_ns for file in out.glob("*/*.*")}.items()
    assert (first_said + said.err).count("integers, seed 9") == 1
    assert max(len(line) for line in said.out.splitlines() if ": /" not in line) <= 80
    fresh = said.out.index("Fresh problems, seed 9: 6 problems of 2 families")
    assert fresh < said.out.index("Public problems: 4 problems of 2 families")
    page = (out / "index.html").read_text()
    assert page.count("<svg") >= 6
    assert re.search(r"^soth, LexLS +no package on PyPI", said.out, re.MULTILINE)
    for text in ("Fresh problems, seed 9", "Moody", "fake 1", "hierarchy", "over border"):
        assert text in page
    assert not re.search(r'(src|href)="http', page)


def test_the_check_accepts_the_example_of_the_documents_and_not_what_ends(tmp_path, command):
    page = (Path(__file__).parents[2] / "docs" / "extending" / "entrant.md").read_text()
    (tmp_path / "mine.py").write_text(re.search(r"```python\n(.*?)```", page, re.DOTALL)[1])
    command("bench open --check --entrant", f"{tmp_path}/mine.py:Mine")
    broken = {"Raising": "it raises: ArithmeticError: not today", "Moody": "other bits the second",
              "Slow": "it takes longer than --limit"}
    line = " ".join(f"--entrant '{HELPERS}/fake_entrants.py:{name}'" for name in broken)
    said = command(f"bench open --check --limit 0.2 {line}", code=1).out
    for rule in broken.values():
        assert re.search(f"a rule is broken: .*{rule}", said)


def test_what_an_entrant_finds_completes_a_proof(equalities, tmp_path):
    """A file whose candidates led to no proof, and an entrant that has the answer."""
    known = read(equalities)
    none = [prove(h, []) for h in known.problems]
    replace(known, answers=tuple(none)).save(tmp_path / "simple-fresh-7.npz")
    rows = [{"x": proof.x.tolist()} for proof in known.answers]
    opened.improve(tmp_path / "simple-fresh-7.npz", [[{"x": None}] * 5, rows])
    found = read(tmp_path / "simple-fresh-7.npz")
    assert found.digest == known.digest
    assert all(proof.complete for proof in found.answers)
