import dataclasses

import numpy as np
import pytest
from hand_made import asked, recording

from hierarchy import HierarchyError
from scenarios.config import load
from scenarios.config.kinds.frames import ListedPosition
from scenarios.draw.figures import letter, palette, panels
from scenarios.draw.figures.timeline import timeline
from scenarios.loop.simulation import simulate
from scenarios.measure.run_folder import save
from scenarios.recording.recording import Event
from scenarios.results.curves import side_by_side


def beside(panel, recordings):
    return side_by_side(panel, recordings, palette.looks(recordings))


def test_a_variant_has_the_colour_of_its_resolver_and_a_line_of_its_own():
    looks = palette.looks(["tpm-published", "tpm", "hqp osqp", "hqp daqp", "hqp proxqp"])
    assert list(looks) == ["tpm-published", "tpm", "hqp osqp", "hqp daqp", "hqp proxqp"]
    assert looks["tpm"] == (palette.COLOURS["tpm"], palette.SOLID)
    assert looks["tpm-published"].colour == looks["tpm"].colour
    assert looks["hqp proxqp"].dash == palette.SOLID
    assert len(set(looks.values())) == 5


@pytest.mark.parametrize("panel", panels.PANELS, ids=lambda panel: panel.name)
def test_every_panel_draws_a_run_that_has_its_signal(panel):
    run = recording()
    assert panel.fits(run)
    drawn = beside(panel, {"tpm-published": run, "hqp": run})
    assert list(drawn) == ["tpm-published", "hqp"]
    assert drawn["hqp"].axes[0].get_ylim() == drawn["tpm-published"].axes[0].get_ylim()


def test_the_errors_of_listed_tasks_are_drawn_with_a_line_for_each():
    feet = asked(tasks=(ListedPosition(name="left foot", kind="position", frame=""),
                        ListedPosition(name="right foot", kind="position", frame="")))
    run = recording(feet, task_error_left_foot=np.ones((5, 3)),
                    task_error_right_foot=np.full((5, 3), 1e-3))
    (ax,) = beside(panels.PANEL["task-errors"], {"hqp": run})["hqp"].axes
    assert [line.get_label() for line in ax.lines] == ["left foot", "right foot"]
    np.testing.assert_allclose(ax.lines[1].get_ydata(), np.sqrt(3.0))  # [mm]


def test_a_run_far_beyond_the_others_is_cut_and_says_so():
    quiet = recording(v=np.eye(5, 7))
    wild = recording(v=1000.0 * np.eye(5, 7))
    velocities = panels.PANELS[0]
    drawn = beside(velocities, {"a": quiet, "b": quiet, "c": wild})
    texts = [text.get_text() for text in drawn["c"].axes[0].texts]
    assert any("cut" in text for text in texts)
    assert drawn["a"].axes[0].get_ylim()[1] < 10.0


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    short = load("ellipse", ["control.duration=0.3"])
    return save(simulate(short), tmp_path_factory.mktemp("runs") / "run")


def test_figures_drawn_anew_take_the_place_of_those_in_the_run_folder(run_folder, monkeypatch):
    for text in ("old", "new"):
        monkeypatch.setattr(letter, "write_all",
                            lambda recording, folder, text=text: [
                                (folder / name).write_text(text) for name in ("a.svg", "b.svg")])
        assert letter.redraw([run_folder]) == [run_folder / "a.svg", run_folder / "b.svg"]
    assert (run_folder / "b.svg").read_text() == "new"
    assert (run_folder / "run.npz").exists()
    assert not [path for path in run_folder.iterdir() if path.name.startswith(".")]
    with pytest.raises(HierarchyError, match="unknown style 'papr'; did you mean 'paper'"):
        letter.redraw([run_folder], "papr")


def test_tick_times_are_drawn_in_microseconds_beside_the_period():
    (ax,) = letter.tick_times(recording(time_tick=[4e-6, 4e-6, 4e-6, 4e-6, 2e-3])).axes
    few, one = (bar for bar in ax.patches if bar.get_height() > 0.0)
    assert (few.get_height(), one.get_height()) == (4.0, 1.0)
    for bar, time in ((few, 4.0), (one, 2000.0)):
        assert bar.get_x() <= time * (1.0 + 1e-9) <= bar.get_x() + bar.get_width()
    assert ax.lines[0].get_xdata()[0] == pytest.approx(1000.0)


def test_the_stack_over_time_has_a_band_for_each_place_and_a_row_for_each_event():
    run = dataclasses.replace(recording(orders=("a > b", "b"), order=[0, 0, 1, 1, 0]),
                              fault="stopped", events=(Event(2, "overrun", "use"),))
    (ax,) = timeline(run).axes
    assert [text.get_text() for text in ax.get_yticklabels()] == ["1", "2", "overrun: use"]
    assert ax.get_title(loc="left") == "Place in the stack, 2 changes"
    assert ax.get_ylim() == (2.5, -0.5)  # half a row around the three
    assert "fault" in [text.get_text() for text in ax.texts]


def test_the_letters_pairs_are_made_of_its_runs_in_its_order():
    names = ("ellipse-35deg-equality", "ellipse", "ellipse-velocity", "ellipse-35deg", "ellipse-3d")
    runs = [recording(load(name), v=np.full((5, 7), float(i))) for i, name in enumerate(names)]
    drawn = dict(letter.figures(runs))
    assert list(drawn) == ["figure-4-joint-velocities", "figure-5-distances",
                           "figure-6-velocities-and-distance", "figure-7-pointing-error"]
    headings = [ax.get_title(loc="left")[:4] for ax in drawn["figure-5-distances"].axes]
    assert headings == ["(a) ", "(b) ", "Body"]
    speeds = [ax.lines[0].get_ydata()[0] for ax in drawn["figure-4-joint-velocities"].axes]
    assert speeds == [2.0, 1.0]  # the velocity level is (a)
