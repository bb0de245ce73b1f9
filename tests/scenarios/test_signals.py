"""Signals, metrics and figures: what is recorded, and what a module of one's own adds."""

import numpy as np
import pytest

from hierarchy import plugins
from hierarchy.errors import UnknownNameError
from scenarios import load, simulate
from scenarios.draw.figures.palette import looks
from scenarios.draw.figures.panels import Panel
from scenarios.export.mcap import grouped
from scenarios.measure.metrics import Metric
from scenarios.measure.motions import motions
from scenarios.measure.runs import Run, table
from scenarios.recording.signals import Signal, known
from scenarios.results.sections import multiples

pytestmark = pytest.mark.usefixtures("no_plugins")


@pytest.fixture(scope="module")
def run():
    return simulate(load("dual-arm", ["control.duration=0.01"]))


def test_a_signal_that_a_run_lacks_is_absent_and_a_misspelt_one_an_error_with_the_nearest(run):
    assert "minimal_distance" not in run
    assert run.get("minimal_distance", np.zeros(1)).shape == (1,)
    for ask in (lambda: "minimal_distnce" in run, lambda: run["minimal_distnce"],
                lambda: run.get("minimal_distnce", np.zeros(0))):
        with pytest.raises(UnknownNameError, match="minimal_distance"):
            ask()


def test_every_recorded_signal_is_in_the_table_with_its_number_of_axes(run):
    for name, values in run.signals.items():
        assert known(name).shape.strip("(,)").count(",") + 1 == values.ndim, name


def test_a_signal_of_a_plugin_has_its_unit_and_topic_everywhere(run):
    plugins.register("signals", "strain")(Signal("strain", "Pa", "(T,)", "of a link", "/links"))
    assert "strain" not in run
    run.signals["strain"] = np.zeros(run.ticks)
    assert ("strain", "Pa") in {column[:2] for column in run.columns()}
    assert set(grouped(run)["/links"]) == {"strain"}
    del run.signals["strain"]


def test_a_metric_and_a_figure_of_a_plugin_are_in_the_table_and_on_the_page(run):
    @plugins.register("metrics", "strained")
    def strained(recording, by):
        yield Metric("strain_max", "Strain, max", float(recording.ticks), "Pa")

    def draw(ax, recording, colour):
        ax.plot(recording["t"], recording["q"][:, 0], color=colour)

    plugins.register("figures", "first-joint")(Panel("first-joint", "First", "rad", "q", draw))
    ours = Run(run.scenario, "own", "own", run)
    assert ours.metrics["strain_max"].shown_unit == "Pa"
    assert {row.name for row in table([ours])} >= {"strain_max", "speed_max"}
    found = motions([ours])
    assert "own: First" in multiples("dual-arm", found, looks([ours.label]))
