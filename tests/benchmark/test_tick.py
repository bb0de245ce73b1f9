import numpy as np
import pytest

from benchmark import tick
from benchmark.plain import PlainTick
from scenarios.cell.build import build
from scenarios.config import load
from scenarios.loop.controller import Controller
from scenarios.loop.simulation import simulate


@pytest.mark.slow
def test_the_plain_numpy_tick_commands_what_the_compiled_one_does():
    """Else the benchmark would compare two different jobs."""
    scenario = load("ellipse")
    controller, plain = Controller(scenario), PlainTick(scenario, build(scenario))
    path = simulate(scenario)
    for k in range(0, path.ticks, 100):
        state = path["t"][k], path["q"][k], path["v"][k]
        np.testing.assert_allclose(plain.step(*state), controller.command(*state), atol=1e-8)


@pytest.mark.slow
def test_the_tick_benchmark_has_a_row_for_every_candidate():
    rows = tick.run(load("ellipse", ["control.duration=0.6"])).rows["tick"]
    assert [row["tick"] for row in rows] == [*tick.SPECS, "plain numpy"]
    assert all(row["failures"] == 0 and row["ticks"] == 600 - 2 * tick.LEAD_IN for row in rows)
