"""The benchmark of resolvers: everybody asked, every answer judged, nothing cut off."""

import csv
import json

import numpy as np
import pytest

from benchmark import start
from benchmark.solve import resolvers
from benchmark.solve.entrants import NUMPY
from benchmark.start import Case, Done, run
from benchmark.tick import PlainTick
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.simulation import simulate
from scenarios.problems import reference
from scenarios.problems.reference import family
from solvers.qp import backends

pytestmark = pytest.mark.slow

FEW = ("EQ7", "INEQ7")
EQUALITIES = {NUMPY, "augmented", "recursive", "reverse", "sns", "tpm", "tpm-published"}


@pytest.fixture
def few(monkeypatch):
    """Only one problem a family, since one cascade takes 40 ms for one of them."""
    monkeypatch.setattr(resolvers.reference, "family", lambda name: family(name)[:1])


def test_a_row_for_everybody_in_every_family_asked(few, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    found = resolvers.run(seconds=0.001, families=FEW)
    rows = found.rows["resolvers"]
    known = {row["entrant"] for row in rows}
    assert {NUMPY, "augmented", "hcod", "recursive", "reverse", "sns", "tpm", "tpm-published",
            "weighted", "hcod warm", "weighted warm", "hqp proxqp", "hqp proxqp warm"} <= known
    assert {f"hqp {name}" for name in backends.BACKENDS if backends.installed(name)} <= known
    assert {(row["family"], row["entrant"]) for row in rows} == {
        (name, label) for name in FEW for label in known
        if label not in EQUALITIES or name in reference.EQUALITIES}
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


@pytest.mark.slow
def test_the_plain_numpy_tick_commands_what_the_compiled_one_does():
    """Else the benchmark would compare two different jobs."""
    scenario = load("ellipse")
    plain, path = PlainTick(scenario, build(scenario)), simulate(scenario)
    for k in range(0, path.ticks, 100):
        found = plain.step(path["t"][k], path["q"][k], path["v"][k])
        np.testing.assert_allclose(found, path["a"][k], atol=1e-8)


def test_everything_measured_is_told(monkeypatch):
    events = [[0.0, True, "solvers.kernels.a.b"], [2.0, False, "solvers.kernels.a.b"]]
    cases = [Case("help", 0.5, ["a"]), Case("first", None, [start._COMPILE]),
             Case("library", 10.0, ["b"])]
    said = {"help": Done(0.1, 0.09), "first": Done(20.0, 19.0, events), "library": Done(11.0, 8.0),
            "memory": Done(1.0, 1.0, [301.0]), "memory of a worker": Done(1.0, 1.0, [250.0] * 20)}
    monkeypatch.setattr(start, "_cases", lambda folder: cases)
    monkeypatch.setattr(start, "_measured", lambda case: said[case.what])
    found = run()
    assert [row["verdict"] for row in found.rows["start"]] == [
        "met", "", "", "not met", "not met", "met", ""]
    assert [row["value"] for row in found.rows["start"]] == [0.1, 20.0, 2.0, 11.0, 301.0, 250.0, 0]
    assert found.rows["compilation"] == [{"kernel": "solvers.kernels.a.b", "seconds": 2.0}]
    assert "a.b 2.0" in found.sections[0].text


def test_a_process_is_measured_and_one_that_fails_is_named():
    done = start._measured(Case("a sum", None, [
        "-c", "print('noise'); print([sum(range(10**6))])"], repeated=1))
    assert done.said == [499999500000]
    assert 0.0 < done.processor
    with pytest.raises(RuntimeError, match="no such thing"):
        start._measured(Case("a fault", None, ["-c", "raise SystemExit('no such thing')"]))
