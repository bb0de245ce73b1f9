"""The benchmark of resolvers: everybody asked, every answer judged, nothing cut off."""

import csv
import json

import numpy as np
import pytest

from benchmark import start
from benchmark.solve import resolvers
from benchmark.solve.entrants import NUMPY
from benchmark.start import Cost, run
from benchmark.tick import PlainTick
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.simulation import simulate
from scenarios.problems import reference
from scenarios.problems.reference import family
from solvers.qp import backends

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


def test_the_plain_numpy_tick_commands_what_the_compiled_one_does():
    """Else the benchmark would compare two different jobs."""
    scenario = load("ellipse")
    plain, path = PlainTick(scenario, build(scenario)), simulate(scenario)
    for k in range(0, path.ticks, 100):
        found = plain.step(path["t"][k], path["q"][k], path["v"][k])
        np.testing.assert_allclose(found, path["a"][k], atol=1e-8)


def test_everything_measured_is_told(monkeypatch):
    monkeypatch.setattr(start, "beginnings", lambda folder: [Cost("help", 0.1, "s", 0.5, 0.09)])
    monkeypatch.setattr(start, "first_compilation", lambda cache: (
        [Cost("first", 20.0, "s", None, 19.0)], {"solvers.kernels.a.b": 2.0}))
    monkeypatch.setattr(start, "library", lambda folder: Cost("library", 9.0, "s", 10.0, 8.0))
    monkeypatch.setattr(start, "memory", lambda folder: [Cost("a run", 301.0, "MB", 300.0)])
    found = run()
    assert [row["verdict"] for row in found.rows["start"]] == ["met", "", "met", "not met"]
    assert found.rows["compilation"] == [{"kernel": "solvers.kernels.a.b", "seconds": 2.0}]
    assert "a.b 2.0" in found.sections[0].text
