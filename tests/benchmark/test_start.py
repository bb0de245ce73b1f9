
import pytest

from benchmark import start
from benchmark.start import Cost, own_seconds, run


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
    monkeypatch.setattr(start, "memory", lambda folder: [Cost("a run", 301.0, "MB", 300.0)])
    found = run()
    assert [row["verdict"] for row in found.rows["start"]] == ["met", "", "not met"]
    assert found.rows["compilation"] == [{"kernel": "solvers.kernels.a.b", "seconds": 2.0}]
    assert "a.b 2.0" in found.sections[0].text
