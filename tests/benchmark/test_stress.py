"""Generated problems, all resolvers timed and judged, their accuracy."""

import csv
import json
import os

import numpy as np
import pytest

from benchmark import start, stress
from benchmark.solve import first_paper, resolvers
from benchmark.solve.entrants import NUMPY
from benchmark.solve.ours import Ours
from benchmark.start import Case
from benchmark.tick import PlainTick
from hierarchy import Hierarchy
from scenarios import load, simulate
from scenarios.cell.build import build
from scenarios.problems import recorded
from scenarios.problems.recorded import family
from solvers import Resolution, Resolver, Status, names, problems
from solvers.qp import backends

JUDGED = [name for name in ("hcod", "tpm", "recursive") if name in names()]
COUNT = 100 if os.environ.get("NUMBA_DISABLE_JIT") == "1" else 400
PARTS = 2  # so that cores can share them
FIRST = 10_000_000  # seeds that nothing was tuned on


@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("name", JUDGED)
def test_generated_problems_are_solved_and_certified(name, part):
    each = COUNT // PARTS
    found = stress.tally((name, range(FIRST + part * each, FIRST + (part + 1) * each), "recipe"))
    assert not found.failing
    assert found.counts[stress.CERTIFIED] >= 0.999 * each, "the rest says that it is not sure"


@pytest.mark.parametrize("kind", problems.KINDS)
@pytest.mark.parametrize("name", JUDGED[:2])
def test_structured_problems_end_certified_or_with_a_status(name, kind):
    assert not stress.tally((name, range(FIRST, FIRST + 12), kind)).failing


class Wrong(Resolver):
    """Fails on hierarchies in which the third unknown is asked to be above 1."""

    __module__ = "solvers.wrong"  # as one of ours: what a plugin returns is looked at by `Resolver`
    name = "wrong"
    handles = "inequalities"

    def __init__(self, way):
        self.way = way

    def solve(self, h, memory=None):
        triggered = h.n > 2 and bool(((h.A[:, 2] != 0.0) & (h.lower > 1.0)).any())
        if triggered and self.way == stress.RAISED:
            raise ZeroDivisionError
        x = np.full(h.n, np.nan if triggered and self.way == stress.NOT_FINITE else 0.0)
        solved = triggered and self.way == stress.WRONG
        return Resolution(x, Status.SOLVED if solved else Status.ITERATION_LIMIT)


def problem():
    levels = [(np.eye(5), np.full(5, -9.0), np.full(5, 9.0)),
              (np.ones((3, 5)), [0.0, 5.0, 0.0]), (np.eye(5), np.zeros(5))]
    return Hierarchy.from_levels(levels, reference=np.ones(5))


@pytest.mark.parametrize("way", [stress.RAISED, stress.NOT_FINITE, stress.WRONG])
def test_each_way_to_fail_is_told_from_the_others_and_shrunk_to_its_core(way):
    def fails(h):
        return stress.outcome(Wrong(way), h)[0] == way

    assert fails(problem())
    smallest = stress.shrunk(problem(), fails)
    assert (smallest.sizes.tolist(), smallest.n) == ([1], 3)
    assert not smallest.reference.any()


def test_failing_problems_are_listed_and_saved(tmp_path, monkeypatch):
    monkeypatch.setattr(stress, "make", lambda name: Wrong(stress.WRONG))
    monkeypatch.setattr(stress, "_TRIALS", 3)  # every trial is proved wrong, in 120 digits
    found = stress.tally(("wrong", range(1, 2), "recipe"))
    told = stress.report("wrong", {stress.RECIPE: found}, tmp_path)
    assert told.failed
    assert f"recipe, seed {found.failing[0][0]}, {stress.WRONG}" in told.sections[0].text
    assert told.sections[0].tables[0].cells()[0][1][:4] == ["1", "0", "1", "0"]  # 0 certified
    kept = problems.load(next(tmp_path.glob("wrong-*.npz")))
    assert stress.outcome(Wrong(stress.WRONG), kept)[0] == stress.WRONG


def test_strict_resolvers_reach_all_that_the_tasks_can_have(monkeypatch):
    monkeypatch.setattr(first_paper, "FIRST_PAPER", {
        key: sizes[:3] for key, sizes in first_paper.FIRST_PAPER.items()})
    assert first_paper.growth(seconds=0.0).rows["growth"]
    made = {one.label: Ours(**one.options).resolver for one in first_paper.entrants()
            if "resolver" in one.options}
    for row in first_paper.accuracy(arms=50, checked=10).rows["errors"]:
        resolver = made.get(row["entrant"])
        if resolver and resolver.strict and row["case"] in ("regular", "conflict", "crowded"):
            assert max([row[key] for key in row if key.endswith("_max")]) < resolver.accuracy, row
            assert row["certified"] == 1.0, row


FEW = ("EQ7", "INEQ7")
EQUALITIES = {NUMPY, "augmented", "recursive", "reverse", "sns", "tpm", "tpm-published"}


def test_a_row_for_everybody_in_every_family_asked(tmp_path, capsys, monkeypatch):
    """Only one problem a family, since one cascade takes 40 ms for one of them."""
    monkeypatch.setattr(resolvers.recorded, "family", lambda name: family(name)[:1])
    monkeypatch.setenv("COLUMNS", "80")
    found = resolvers.run(seconds=0.001, families=FEW)
    rows = found.rows["resolvers"]
    known = {row["entrant"] for row in rows}
    assert {NUMPY, "augmented", "hcod", "recursive", "reverse", "sns", "tpm", "tpm-published",
            "weighted", "hcod warm", "weighted warm", "hqp proxqp", "hqp proxqp warm"} <= known
    assert {f"hqp {name}" for name in backends.BACKENDS if backends.installed(name)} <= known
    assert {(row["family"], row["entrant"]) for row in rows} == {
        (name, label) for name in FEW for label in known
        if label not in EQUALITIES or name in recorded.EQUALITIES}
    for row in rows:
        if row["entrant"].startswith(("hqp", "hcod")) or row["entrant"] in ("tpm", "recursive"):
            assert row["wrong"] == 0, row
    found.say()
    found.write(tmp_path)
    with (tmp_path / "resolvers.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(rows)
    assert {path.name for path in tmp_path.iterdir()} == {
        "resolvers.csv", "machine.json", "missing.json", "time-accuracy.svg", "time-accuracy.png",
        "index.html"}
    assert "processor" in json.loads((tmp_path / "machine.json").read_text())
    out = capsys.readouterr().out
    assert max(map(len, out.splitlines())) <= 80
    assert "…" not in out


def test_the_plain_numpy_tick_commands_what_the_compiled_one_does():
    """Else the benchmark would compare two different jobs."""
    scenario = load("ellipse")
    plain, path = PlainTick(scenario, build(scenario)), simulate(scenario)
    for k in range(0, path.ticks, 100):
        found = plain.step(path["t"][k], path["q"][k], path["v"][k])
        np.testing.assert_allclose(found, path["a"][k], atol=1e-8)


def test_a_process_is_measured_and_one_that_fails_is_named():
    _, processor, said = start._measured(Case("a sum", None, [
        "-c", "print('noise'); print([sum(range(10**6))])"], repeated=1))
    assert said == [499999500000]
    assert 0.0 < processor
    with pytest.raises(RuntimeError, match="no such thing"):
        start._measured(Case("a fault", None, ["-c", "raise SystemExit('no such thing')"]))
    with pytest.raises(RuntimeError, match="unknown scenario 'elipse'"):
        start._measured(Case("a run", None, ["-c", start._COMMAND, "run", "elipse"]))
