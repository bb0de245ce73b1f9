import dataclasses
import itertools
import re

import numpy as np
import pytest
from hand_made import HandMadeScenario, recording
from matplotlib.colors import to_hex
from matplotlib.patches import Patch

from hierarchy import HierarchyError
from scenarios.config import load
from scenarios.config.kinds.frames import ListedPosition
from scenarios.draw.figures import drawing, letter, palette, panels
from scenarios.draw.figures.picture import picture
from scenarios.draw.figures.timeline import timeline
from scenarios.loop.simulation import simulate
from scenarios.measure.run_folder import save
from scenarios.recording.recording import Event
from scenarios.results.curves import computing_time, overlay, side_by_side


def beside(panel, recordings):
    return side_by_side(panel, recordings, palette.looks(recordings))


def test_a_thinned_curve_keeps_its_ends_and_every_peak():
    y = np.sin(np.linspace(0, 9, 20_000))
    y[12_345] = 7.0
    kept = drawing.envelope(y)
    assert len(kept) < 1_000
    assert {0, 12_345, len(y) - 1} <= set(kept.tolist())
    assert (np.diff(kept) > 0).all()


# Linear RGB as it is seen by most, and with each kind of colour blindness.
SEEN_AS = {
    "as most see": np.eye(3),
    "protanopia": np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216],
                            [-0.003882, -0.048116, 1.051998]]),
    "deuteranopia": np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413],
                              [-0.011820, 0.042940, 0.968881]]),
    "tritanopia": np.array([[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602],
                            [0.004733, 0.691367, 0.303900]])}


def linear(colour):
    """Linear RGB (3,) of "#rrggbb"."""
    c = np.array([int(colour[i:i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def cielab(rgb):
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722],
                       [0.0193, 0.1192, 0.9505]])
    x = to_xyz @ np.clip(rgb, 0.0, 1.0) / [0.9505, 1.0, 1.089]
    f = np.where(x > 0.008856, np.cbrt(x), 7.787 * x + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(one, other):
    """Ratio of luminances as WCAG 2 defines it."""
    low, high = sorted(float([0.2126, 0.7152, 0.0722] @ linear(c)) for c in (one, other))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("eyes", SEEN_AS)
def test_the_colours_of_any_two_resolvers_are_told_apart(eyes):
    seen = [cielab(SEEN_AS[eyes] @ linear(c)) for c in palette.COLOURS.values()]
    apart = min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2))
    assert apart > 16.0


@pytest.mark.parametrize("ground", ["#ffffff", "#14171a"])
def test_the_colours_are_legible_on_light_and_dark(ground):
    assert min(contrast(c, ground) for c in palette.COLOURS.values()) > 2.2


def test_a_variant_has_the_colour_of_its_resolver_and_a_line_of_its_own():
    looks = palette.looks(["tpm-published", "tpm", "hqp osqp", "hqp daqp", "hqp proxqp"])
    assert list(looks) == ["tpm-published", "tpm", "hqp osqp", "hqp daqp", "hqp proxqp"]
    assert looks["tpm"] == (palette.COLOURS["tpm"], palette.SOLID)
    assert looks["tpm-published"].colour == looks["tpm"].colour
    assert looks["hqp proxqp"].dash == palette.SOLID
    assert len(set(looks.values())) == 5


def test_shared_limits_leave_out_the_one_run_that_would_flatten_the_others():
    low, high = drawing.shared_limits([(-1.0, 1.0), (-1.2, 1.1), (-80.0, 90.0)])
    assert -2.0 < low < -1.2
    assert 1.1 < high < 2.0


@pytest.mark.slow
@pytest.mark.parametrize("panel", panels.PANELS, ids=lambda panel: panel.name)
def test_every_panel_draws_a_run_that_has_its_signal(panel):
    run = recording()
    assert panel.fits(run)
    drawn = beside(panel, {"tpm-published": run, "hqp": run})
    assert list(drawn) == ["tpm-published", "hqp"]
    assert drawn["hqp"].axes[0].get_ylim() == drawn["tpm-published"].axes[0].get_ylim()


def test_the_errors_of_listed_tasks_are_drawn_with_a_line_for_each():
    asked = HandMadeScenario(tasks=(ListedPosition(name="left foot", kind="position", frame=""),
                                    ListedPosition(name="right foot", kind="position", frame="")))
    run = recording(asked, task_error_left_foot=np.ones((5, 3)),
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


def letters(name, **changed):
    """A run made by hand that passes for the whole run of a shipped scenario."""
    return recording(load(name), **changed)


def test_only_the_letters_own_runs_have_the_numbers_of_its_figures():
    def stems(run):
        return {stem for stem, _ in letter.figures([run])}

    assert not [stem for stem in stems(recording()) if stem.startswith("figure")]
    assert {stem for stem in stems(letters("ellipse")) if stem.startswith("figure")} == {
        "figure-4b-joint-velocities", "figure-5-distances"}
    assert "figure-4a-joint-velocities" in stems(letters("ellipse-velocity"))
    assert "figure-6-velocities-and-distance" in stems(letters("ellipse-3d"))
    other = load("ellipse").with_resolver("hcod"), load("ellipse", ["pointing.alpha_d=6.0"])
    for scenario in other:
        assert not [stem for stem in stems(recording(scenario)) if stem.startswith("figure")]
    assert not [stem for stem in stems(letters("ellipse", fault="stopped"))
                if stem.startswith("figure")]


def test_the_letters_pairs_are_made_of_its_runs_in_its_order():
    names = ("ellipse-35deg-equality", "ellipse", "ellipse-velocity", "ellipse-35deg", "ellipse-3d")
    runs = [letters(name, v=np.full((5, 7), float(i))) for i, name in enumerate(names)]
    drawn = dict(letter.figures(runs))
    assert list(drawn) == ["figure-4-joint-velocities", "figure-5-distances",
                           "figure-6-velocities-and-distance", "figure-7-pointing-error"]
    headings = [ax.get_title(loc="left")[:4] for ax in drawn["figure-5-distances"].axes]
    assert headings == ["(a) ", "(b) ", "Body"]
    speeds = [ax.lines[0].get_ydata()[0] for ax in drawn["figure-4-joint-velocities"].axes]
    assert speeds == [2.0, 1.0]  # the velocity level is (a)


@pytest.mark.slow
def test_an_inline_svg_follows_the_page_and_brings_no_ids_that_could_clash():
    fig, (ax,) = drawing.figure()
    ax.plot([0.0, 1.0], [0.123456, 1.0])
    text = drawing.svg(fig, 'a "title" & more')
    assert text.startswith('<svg role="img" aria-label="a &#34;title&#34; &amp; more"')
    assert "currentColor" in text
    assert drawing.INK not in text
    assert 'id="figure_1"' not in text
    assert "<metadata" not in text


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory):
    short = load("ellipse", ["control.duration=0.3"])
    return save(simulate(short), tmp_path_factory.mktemp("runs") / "run")


@pytest.fixture(scope="module")
def paper(run_folder):
    return letter.redraw([run_folder], "paper", run_folder.parent / "paper")


@pytest.mark.slow
def test_figures_for_a_paper_are_vectors_one_column_wide_with_their_fonts_inside(paper):
    assert {file.suffix for file in paper} == {".pdf"}
    assert {"distances", "picture", "stack"} <= {file.stem for file in paper}
    for file in paper:
        content = file.read_bytes()
        assert re.findall(rb"/MediaBox \[ *0 0 ([0-9.]+) ", content) == [b"252"]  # 3.5 inch
        assert b"/Subtype /Image" not in content
        assert b"/Subtype /Type3" not in content
        assert b"/CreationDate" not in content
        assert (b"/FontFile2" in content) is (file.stem != "picture")  # which has no letters


def test_figures_drawn_anew_take_the_place_of_those_in_the_run_folder(run_folder, monkeypatch):
    for text in ("old", "new"):
        monkeypatch.setattr(letter, "write_all",
                            lambda recording, folder, text=text: [
                                (folder / name).write_text(text) for name in ("a.svg", "b.svg")])
        assert letter.redraw([run_folder]) == [run_folder / "a.svg", run_folder / "b.svg"]
    assert (run_folder / "b.svg").read_text() == "new"
    assert (run_folder / "run.npz").exists()
    assert not [path for path in run_folder.iterdir() if path.name.startswith(".")]


def test_a_style_or_folder_that_is_not_there_is_an_error_that_names_it(run_folder, tmp_path):
    with pytest.raises(HierarchyError, match="unknown style 'papr'; did you mean 'paper'"):
        letter.redraw([run_folder], "papr")
    with pytest.raises(HierarchyError, match="nothing"):
        letter.redraw([tmp_path / "nothing"])


@pytest.mark.parametrize("label", ["tpm-published", "recursive", "hqp osqp"])
def test_a_resolver_has_its_colour_in_every_figure(label):
    runs, wanted = {label: recording(), "hcod": recording()}, palette.colour(label)
    looks = palette.looks(runs)
    drawn = [side_by_side(panels.PANEL["body-distance"], runs, looks)[label].axes[0].lines,
             overlay(panels.position_error, runs, looks).axes[0].lines,
             picture(runs).axes[0].lines, computing_time(runs, looks).axes[0].lines]
    for artists in drawn:
        colours = [to_hex(one.get_facecolor() if isinstance(one, Patch) else one.get_color())
                   for one in artists]
        assert wanted in colours


def test_tick_times_are_drawn_in_microseconds_beside_the_period():
    (ax,) = letter.tick_times(recording(time_tick=[4e-6, 4e-6, 4e-6, 4e-6, 2e-3])).axes
    bars = [bar for bar in ax.patches if bar.get_height() > 0.0]
    assert [bar.get_height() for bar in bars] == [4.0, 1.0]
    assert [bar.get_x() <= time * (1.0 + 1e-9) <= bar.get_x() + bar.get_width()
            for bar, time in zip(bars, (4.0, 2000.0), strict=True)] == [True, True]
    assert ax.lines[0].get_xdata()[0] == pytest.approx(1000.0)


def test_the_stack_over_time_has_a_band_for_each_place_and_a_row_for_each_event():
    run = dataclasses.replace(recording(orders=("a > b", "b"), order=[0, 0, 1, 1, 0]),
                              fault="stopped", events=(Event(2, "overrun", "use"),))
    (ax,) = timeline(run).axes
    assert [text.get_text() for text in ax.get_yticklabels()] == ["1", "2", "overrun: use"]
    assert ax.get_title(loc="left") == "Place in the stack, 2 changes"
    assert ax.get_ylim() == (2.5, -0.5)  # half a row around the three
    assert "fault" in [text.get_text() for text in ax.texts]
