"""The open benchmark: what it makes of entrants, how it judges, what it prints and draws."""

import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hierarchy import Hierarchy
from hierarchy.errors import HierarchyError
from scenarios.bench.open import entrants, process
from scenarios.bench.open import judge as judging
from scenarios.bench.open.entrant import Problem, read_problems
from scenarios.bench.open.judge import judge
from scenarios.bench.open.page import lead
from scenarios.bench.open.printing import insides
from scenarios.bench.open.process import CRASHED, HUNG, LEFT_OUT
from scenarios.bench.open.results import Half
from scenarios.bench.open.store import COLUMNS, Store, read_rows
from scenarios.bench.open.summary import Times, profile, summary
from scenarios.bench.open.table import ENTRANTS, OWN, Row, chosen
from scenarios.bench.open.worker import REPEATS
from scenarios.cli.main import run_command
from solvers.problems.files import Collection, Head
from solvers.proof import prove

HELPERS = Path(__file__).parents[1] / "helpers"


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


def run_entrant(row, file, count, limit=process.LIMIT):
    return next(process.run_entrant(row, [file], [count], limit))


def fake(name, **options):
    return Row(name, OWN, f"{HELPERS / 'fake_entrants.py'}:{name}", options=options)


def ends(answers):
    return [answer.get("ended") for answer in answers]


def test_every_resolver_of_the_project_is_an_entrant():
    from solvers import names
    from solvers.qp.backends import BACKENDS

    labels = {row.label for row in ENTRANTS}
    assert {name for name in names() if name != "hqp"} <= labels
    assert {f"hqp {name}" for name in BACKENDS} <= labels
    assert len(labels) == len(ENTRANTS)


@pytest.mark.slow
def test_a_crash_costs_one_problem(equalities):
    about, answers = run_entrant(fake("Crashing"), equalities, 5)
    assert about["version"] == "fake 1"
    assert ends(answers) == [None, None, CRASHED, None, None]
    assert "code -9" in answers[2]["why"]
    assert answers[4]["x"] == pytest.approx([4.0, 1.0])
    assert [answer["problem"] for answer in answers] == [0, 1, 2, 3, 4]


@pytest.mark.slow
def test_one_process_serves_all_files_until_it_ends(equalities):
    said = list(process.run_entrant(fake("Crashing"), [equalities] * 2, [5, 5]))
    assert [ends(answers) for _, answers in said] == [[None, None, CRASHED, None, None]] * 2
    assert said[1][1][4]["x"] == pytest.approx([4.0, 1.0])


@pytest.mark.slow
def test_a_hang_costs_one_problem(equalities):
    _, answers = run_entrant(fake("Hanging"), equalities, 5, limit=1.0)
    assert ends(answers) == [None, None, HUNG, None, None]


@pytest.mark.slow
def test_what_is_raised_is_told_and_what_is_printed_does_not_mix(equalities):
    _, answers = run_entrant(fake("Raising"), equalities, 5)
    assert [answer["raised"] for answer in answers] == ["ArithmeticError: not today"] * 5


@pytest.mark.slow
def test_an_entrant_that_cannot_start_is_missing_with_the_reason(equalities):
    from scenarios.bench.peers.environments import MissingError

    with pytest.raises(MissingError, match="takes no arguments"):
        run_entrant(fake("LeastSquares", no=1), equalities, 5)
    with pytest.raises(MissingError, match="No such file"):
        run_entrant(replace(fake("LeastSquares"), python="/no/such/python"), equalities, 5)


@pytest.mark.slow
def test_an_entrant_that_starts_warm_is_asked_warm(equalities):
    _, answers = run_entrant(fake("Starting"), equalities, 5)
    assert all(answer["warm_ns"] and answer["warm_solved"] for answer in answers)
    assert answers[3]["warm_x"] == pytest.approx([3.0, 1.0])


@pytest.mark.slow
def test_an_entrant_that_crashes_for_ever_is_left_out_in_the_end(monkeypatch, equalities):
    monkeypatch.setattr(process, "MOST_ENDS", 2)
    _, answers = run_entrant(fake("Doomed"), equalities, 5)
    assert ends(answers) == [CRASHED, CRASHED, LEFT_OUT, LEFT_OUT, LEFT_OUT]
    assert "code 3" in answers[0]["why"]


CXX = next(filter(None, map(shutil.which, ("c++", "g++", "clang++"))), None)
LIBRARY = """
#include "timed.h"

extern "C" {
void* prepare(int n, int, const long*, const double*, const double* lower, const double*,
              const double*) {
  auto* x = new double[2];
  x[0] = lower[0], x[1] = lower[1];
  return n == 2 ? x : nullptr;
}
int solve(void*) { return 1; }
int solve_timed(void* handle, const repeats* limits, long long* times) {
  return timed([=] { solve(handle); }, limits, times);
}
void answer(void* handle, double* x, int* iterations) {
  x[0] = static_cast<double*>(handle)[0], x[1] = static_cast<double*>(handle)[1], *iterations = 7;
}
void release(void* handle) { delete[] static_cast<double*>(handle); }
}
"""
"""Solves levels of the identity."""


@pytest.mark.slow
@pytest.mark.skipif(CXX is None, reason="no compiler of C++")
def test_a_compiled_entrant_is_timed_from_python_and_inside(tmp_path, equalities):
    (tmp_path / "one.cpp").write_text(LIBRARY)
    shims = Path(entrants.__file__).with_name("shims")
    subprocess.run([CXX, "-std=c++14", "-O2", "-fPIC", "-shared", f"-I{shims}",
                    tmp_path / "one.cpp", "-o", tmp_path / "one.so"], check=True)
    row = Row("one", OWN, "scenarios.bench.open.entrants.compiled:Compiled",
              options={"library": str(tmp_path / "one.so"), "name": "one 1"})
    _, answers = run_entrant(row, equalities, 5)
    assert [answer["x"] for answer in answers] == [[float(side), 1.0] for side in range(5)]
    for answer in answers:
        assert 1 <= len(answer["cold_inside_ns"]) <= REPEATS.most  # once if the machine is slow
        assert 0 <= min(answer["cold_inside_ns"]) < min(answer["cold_ns"])
        assert "warm_ns" not in answer


@pytest.mark.slow
def test_an_entrant_in_python_has_no_times_inside(equalities):
    _, answers = run_entrant(fake("Starting"), equalities, 5)
    assert all(answer["cold_inside_ns"] == answer["warm_inside_ns"] == [] for answer in answers)


def test_the_worker_reads_the_problems_that_were_written(tmp_path):
    from solvers import problems

    found = tuple(problems.structured(seed) for seed in range(5))
    Collection(Head("mixed", "", "fresh", 1), found).save(tmp_path / "mixed.npz")
    for h, one in zip(found, read_problems(tmp_path / "mixed.npz"), strict=True):
        for name in ("A", "lower", "upper", "sizes", "reference"):
            np.testing.assert_array_equal(getattr(one, name), getattr(h, name))


def test_a_problem_without_its_last_level_skips_empty_ones():
    sizes = np.array([1, 0, 2, 0])
    one = Problem(np.eye(3), np.zeros(3), np.ones(3), sizes, np.zeros(3)).without_last()
    assert one is not None
    assert one.sizes.tolist() == [1, 0]
    assert one.A.shape == (1, 3)
    assert one.without_last() is None


def raw(x, collected, problem=0, solved=True, **more):
    said = {"entrant": "one", "version": "1", "family": "simple", "half": "fresh", "seed": 7,
            "sha256": collected.digest, "problem": problem, "solved": solved, "same": True,
            "x": None if x is None else list(map(float, x)), "cold_ns": [1000, 3000, 2000]}
    return {**dict.fromkeys(COLUMNS), **said, **more}


def judged(x, solved=True, **more):
    one = collection([simple(3.0)])
    return judge([raw(x, one, solved=solved, **more)], {one.digest: one})[0]


@pytest.mark.parametrize(("x", "solved", "verdict", "level"), [
    ([3.0, 1.0], True, judging.SOLVED, -1), ([3.0, 1.0], False, judging.MODEST, -1),
    ([3.0 + 1e-7, 1.0], True, judging.SOLVED, -1), ([3.1, 1.0], True, judging.WRONG, 0),
    ([3.0, 1.5], True, judging.WRONG, 1), ([3.0, 0.5], True, judging.WRONG, 2),
    ([3.0, 0.5], False, judging.FAILED, 2), ([np.nan, 1.0], True, judging.WRONG, 0),
    ([3.0], True, judging.WRONG, 0)])
def test_only_x_decides_whether_an_answer_is_right(x, solved, verdict, level):
    one = judged(x, solved)
    assert (one.verdict, one.level) == (verdict, level)


def test_a_miss_is_told_in_the_rows_unit_and_relative():
    one = judged([3.0, 0.5])
    assert one.absolute == pytest.approx(1.0)  # |2 * 0.5 - 4| beyond 2
    assert one.relative == pytest.approx(1.0 / (2.0 * (1.0 + np.sqrt(10.0))))


def test_the_distance_to_the_reference_counts_as_a_last_level():
    h = Hierarchy.from_levels([([[1.0, 0.0]], [1.0])], reference=[0.0, 5.0])
    one = collection([h])
    near, far = judge([raw([1.0, 5.0], one), raw([1.0, 4.0], one)], {one.digest: one})
    assert near.verdict == judging.SOLVED
    assert (far.verdict, far.level) == (judging.WRONG, 1)


def test_what_moves_a_level_above_is_seen():
    assert judged([3.0, 1.0], without=[3.0, 0.0]).moved == 0.0
    assert judged([3.5, 1.0], without=[3.0, 0.0]).moved == pytest.approx(0.5 / (1 + 10**0.5))


@pytest.mark.parametrize(("more", "verdict"), [
    ({"ended": CRASHED}, judging.CRASHED), ({"ended": HUNG}, judging.HUNG),
    ({"ended": LEFT_OUT}, judging.CRASHED), ({"refused": "no"}, judging.REFUSED),
    ({"raised": "Error"}, judging.RAISED)])
def test_what_is_not_answered_has_its_own_verdict(more, verdict):
    assert judged(None, **more).verdict == verdict


def test_a_warm_answer_is_judged_as_well():
    assert judged([3.0, 1.0], warm_x=[3.0, 1.0], warm_solved=True).warm_right is True
    assert judged([3.0, 1.0], warm_x=[3.0, 0.0], warm_solved=True).warm_right is False
    assert judged([3.0, 1.0]).warm_right is None


def test_problems_of_which_nothing_is_proved_are_left_out():
    one = collection([simple(3.0)])
    nothing = replace(one.answers[0], proved=0)
    assert judge([raw([9.0, 9.0], one)],
                 {one.digest: replace(one, answers=(nothing,))}) == []
    assert judge([raw([9.0, 9.0], one)], {}) == []


def test_a_level_that_is_ill_posed_is_not_judged():
    one = collection([simple(3.0)])
    upper = replace(one, answers=(replace(one.answers[0], posed=1),))
    assert judge([raw([3.0, 7.0], one)], {one.digest: upper})[0].verdict == judging.SOLVED


def test_a_summary_counts_and_takes_the_worst_of_what_is_called_solved():
    one = collection([simple(3.0), simple(1.0)], sequence=True)
    rows = judge([raw([3.0, 1.0], one), raw([1.5, 1.0], one, 1)], {one.digest: one})
    found = summary(rows, {"simple": 2.0})
    assert found.right == 0.5
    assert found.counts[judging.WRONG] == 1
    assert found.absolute == pytest.approx(0.5)
    assert found.rough == pytest.approx(0.75)  # 1.5 where the proved answers move by 2
    assert (found.cold.median, found.cold.largest) == (2.0, 3.0)
    assert np.isnan(found.cold.p999)


def test_rare_times_need_a_thousand():
    assert np.isnan(Times.of([1000] * 999).p999)
    assert Times.of([1000] * 1000).p999 == 1.0


def test_a_profile_counts_only_what_is_solved():
    one = collection([simple(3.0), simple(1.0)])
    rows = judge([raw([3.0, 1.0], one), raw([9.0, 1.0], one, 1),
                  raw([3.0, 1.0], one, entrant="slow", cold_ns=[4000]),
                  raw([1.0, 1.0], one, 1, entrant="slow", cold_ns=[4000])], {one.digest: one})
    found = profile(rows, np.array([1.0, 2.0, 10.0]))
    np.testing.assert_array_equal(found["one"], [0.5, 0.5, 0.5])  # twice as fast, once wrong
    np.testing.assert_array_equal(found["slow"], [0.5, 1.0, 1.0])


def test_the_first_lines_name_a_solver_of_others_that_is_faster():
    one = collection([simple(3.0)])
    rows = judge([raw([3.0, 1.0], one, entrant="hcod", version="task-hierarchy 1", cold_ns=[4000]),
                  raw([3.0, 1.0], one, entrant="tpm", version="task-hierarchy 1", cold_ns=[900]),
                  raw([3.0, 1.0], one, entrant="other", cold_ns=[1000])], {one.digest: one})
    half = Half("Fresh problems, seed 7", tuple(rows), {"simple": one})
    assert ("A solver of others is right as often as hcod, and faster, in simple (other: 1.00 µs "
            "against 4.00 µs), each called from Python.") in lead(half)


def test_inside_compiled_code_ours_is_compared_with_that_of_others():
    one = collection([simple(3.0)])

    def row(entrant, version, python, inside):
        return raw([3.0, 1.0], one, entrant=entrant, version=version, cold_ns=[python],
                   cold_inside_ns=[inside] if inside else None)

    rows = [row("hcod in C", "task-hierarchy 1, C library", 1500, 800),
            row("hcod", "task-hierarchy 1", 2000, 0),
            row("other", "1", 1400, 700), row("in Python", "1", 9000, 0)]
    half = Half("Fresh problems, seed 7", tuple(judge(rows, {one.digest: one})), {"simple": one})
    said = " ".join(lead(half))
    assert "faster, in simple (other: 1.40 µs against 2.00 µs), each called from Python" in said
    assert "faster, in simple (other: 0.70 µs against 0.80 µs)." in said
    assert "the problems, hcod, hcod in C, other and in Python solve the most" in said
    rows[2]["cold_inside_ns"] = [900]  # of "other"
    half = replace(half, rows=tuple(judge(rows, {one.digest: one})))
    assert "none is right as often as hcod in C and faster" in " ".join(lead(half))


def test_times_inside_stand_beside_those_from_python():
    one = collection([simple(3.0)])
    rows = judge([raw([3.0, 1.0], one, cold_inside_ns=[1500], warm_x=[3.0, 1.0], warm_solved=True,
                      warm_ns=[1000], warm_inside_ns=[500]),
                  raw([3.0, 1.0], one, entrant="in Python")], {one.digest: one})
    cold, warm = insides(Half("Fresh", tuple(rows), {"simple": one}), 80)
    assert [list(column.cells) for column in cold.columns] == [["simple"], ["2.00"], ["1.50"]]
    assert [list(column.cells) for column in warm.columns] == [["simple"], ["1.00"], ["0.50"]]


def test_rows_of_another_version_are_refused(tmp_path):
    import pyarrow
    from pyarrow import parquet

    parquet.write_table(pyarrow.table({"entrant": ["one"]}), tmp_path / "old.parquet")
    with pytest.raises(HierarchyError, match="columns of another version; remove it"):
        read_rows(tmp_path / "old.parquet")


def test_rows_come_back_as_they_were_stored(tmp_path):
    store, one = Store(tmp_path), collection([simple(3.0)])
    row = raw([3.0, 1.0], one, iterations=4)
    store.add([row], store.file_of("a, b", Path("simple-fresh-7.npz")))
    assert store.rows() == [row]


def test_the_documents_ask_for_parts_that_the_report_can_make():
    import open_report

    root = Path(__file__).parents[2]
    asked = {found["name"] for page in open_report.PAGES
             for found in open_report.BLOCK.finditer((root / page).read_text(encoding="utf-8"))}
    assert asked <= set(open_report.PARTS)
    assert {"lead", "problems", "fresh answers", "public answers"} <= asked


def test_an_unknown_entrant_and_a_missing_file_are_refused():
    with pytest.raises(HierarchyError, match="did you mean 'hcod'"):
        chosen(["hcodd"])
    with pytest.raises(HierarchyError, match="does not exist"):
        chosen(["no/such/file.py:Mine"])
    assert [row.label for row in chosen(["tpm", "hcod"])] == ["tpm", "hcod"]


@pytest.mark.slow
def test_a_checkout_without_the_package_is_refused(tmp_path, capsys):
    assert run_command(["bench", "open", "--soth", str(tmp_path)]) == 2
    assert "no checkout of soth" in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_runs_continues_and_writes_its_page(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    out = tmp_path / "open"
    line = ["bench", "open", "--family", "integers", "--family", "one_unknown", "--count", "3",
            "--public", "2", "--fresh", "9", "--entrant", "hcod", "--out", str(out)]
    mine = f"{HELPERS / 'fake_entrants.py'}:Moody"
    assert run_command(line) == 0
    first = {file: file.stat().st_mtime_ns for file in out.glob("*/*")}
    assert len(first) == 8  # four files of problems, four of rows
    (out / "missing.json").write_text('{"absent": "not installed", "Moody": "not installed"}')
    assert run_command([*line, "--entrant", mine]) == 0
    assert json.loads((out / "missing.json").read_text()) == {"absent": "not installed"}
    assert first.items() <= {file: file.stat().st_mtime_ns for file in out.glob("*/*")}.items()
    said = capsys.readouterr()
    assert said.err.count("integers, seed 9") == 1
    assert all(len(line) <= 80 or line.startswith("Page: ") for line in said.out.splitlines())
    assert "…" not in said.out
    fresh = said.out.index("Fresh problems, seed 9: 6 problems of 2 families")
    assert fresh < said.out.index("Public problems: 4 problems of 2 families")
    page = (out / "index.html").read_text()
    assert page.count("<svg") >= 6
    for text in ("Fresh problems, seed 9", "Moody", "fake 1", "hierarchy"):
        assert text in page
    assert not re.search(r'(src|href)="http', page)


@pytest.mark.slow
def test_the_check_accepts_the_template_and_not_what_ends(capsys):
    template = Path(entrants.__file__).with_name("template.py")
    assert run_command(["bench", "open", "--check", "--entrant", f"{template}:Template"]) == 0
    assert run_command(["bench", "open", "--check", "--entrant",
                        f"{HELPERS / 'fake_entrants.py'}:Raising"]) == 1
    assert "the rules are broken" in capsys.readouterr().out
