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
from computed_bench import collection, simple

from benchmark import solve
from benchmark.packages import OWN, Entrant
from benchmark.process import CRASHED, HUNG, LEFT_OUT, Field
from benchmark.solve import judge as judging
from benchmark.solve import open as opened
from benchmark.solve import resolvers
from benchmark.solve.entrants import chosen, compiled
from benchmark.worker import Repeats
from hierarchy import Hierarchy, HierarchyError
from solvers import make
from solvers.problems.files import read
from solvers.proof import prove

HELPERS = Path(__file__).parents[1] / "helpers"
SOLVE = Path(solve.__file__).parent


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
