"""The benchmark of resolvers: everybody asked, every answer judged, nothing cut off."""

import csv
import json

import numpy as np
import pytest

from benchmark import start, tick
from benchmark.solve import resolvers
from benchmark.solve.entrants import HIERARCHICAL, NUMPY
from benchmark.start import Cost, own_seconds, run
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


def test_fresh_problems_are_timed_and_reported_apart(few):
    found = resolvers.run(seconds=0.001, families=("EQ7", "INEQ7"), seed=10_000_000, count=4,
                          resolvers=["hcod"])
    rows = found.rows["resolvers"]
    assert {(row["family"], row["origin"], row["problems"]) for row in rows} == {
        (name, origin, count) for name in ("EQ7", "INEQ7")
        for origin, count in (("known", 1), ("fresh", 4))}
    assert {row["entrant"] for row in rows} == {NUMPY, HIERARCHICAL, "hcod", "hcod warm"}
    assert all(row["wrong"] == 0 for row in rows if row["entrant"] in ("hcod", "hcod warm"))
    assert [table.title for table in found.sections[1].tables] == ["EQ7, fresh", "INEQ7, fresh"]


def test_seconds_of_what_is_compiled_within_are_not_counted_twice():
    events = [(0.0, True, "outer"), (1.0, True, "inner"), (4.0, False, "inner"),
              (5.0, True, "inner"), (6.0, False, "inner"), (10.0, False, "outer")]
    assert own_seconds(events) == {"outer": 6.0, "inner": 4.0}


@pytest.mark.slow
def test_compiling_is_recorded_and_nested_rightly(tmp_path, monkeypatch):
    """One small kernel of our own, in an empty cache."""
    monkeypatch.setattr(start, "_COMPILE", """
import json
from numba.core import event
with event.install_recorder("numba:compile") as recorder:
    from hierarchy.limits import write_box
    import numpy as np
    one = np.ones(1)
    write_box(one, one, np.ones((6, 1)), False, one.copy(), one.copy(), 0)
events = [(at, e.is_start, e.data["dispatcher"].py_func) for at, e in recorder.buffer]
print(json.dumps([[at, start, f.__module__ + "." + f.__name__] for at, start, f in events]))""")
    monkeypatch.setattr(start, "_SOLVE", "pass")
    costs, kernels = start.first_compilation(tmp_path / "cache")
    assert "hierarchy.limits.write_box" in kernels
    assert all(seconds >= 0.0 for seconds in kernels.values())
    assert costs[2].value <= costs[1].value


def test_a_process_that_fails_is_an_error_with_its_words():
    with pytest.raises(RuntimeError, match="went wrong"):
        start._run(["-c", "raise SystemExit('it went wrong')"])


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


@pytest.mark.slow
def test_the_plain_numpy_tick_commands_what_the_compiled_one_does():
    """Else the benchmark would compare two different jobs."""
    scenario = load("ellipse")
    plain, path = PlainTick(scenario, build(scenario)), simulate(scenario)
    for k in range(0, path.ticks, 100):
        found = plain.step(path["t"][k], path["q"][k], path["v"][k])
        np.testing.assert_allclose(found, path["a"][k], atol=1e-8)


@pytest.mark.slow
def test_the_tick_benchmark_has_a_row_for_every_candidate(monkeypatch):
    monkeypatch.setattr(tick, "_ROUNDS", 2)
    rows = tick.run(load("ellipse", ["control.duration=0.6"])).rows["tick"]
    assert [row["tick"] for row in rows] == [*tick.SPECS, "plain numpy"]
    assert all(row["failures"] == 0 for row in rows)
    assert [row["ticks"] for row in rows] == [2 * (600 - tick.LEAD_IN)] * 4 + [600 - tick.LEAD_IN]
    assert all(row["median_us"] <= row["p95_us"] for row in rows)
