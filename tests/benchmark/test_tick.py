"""Ticks of `ellipse`, compiled and plain."""

import numpy as np
import pytest

from benchmark import tick
from benchmark.tick import PlainTick
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.simulation import simulate


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
