import itertools

import numpy as np
import pytest
from hand_made import recording

import solvers
from scenarios import drawing, figures, palette, panels
from scenarios.picture import picture
from scenarios.report.figures import side_by_side


def beside(panel, recordings):
    return side_by_side(panel, recordings, palette.looks(recordings))


def spiky(ticks=20_000):
    values = np.sin(np.linspace(0, 9, ticks))
    values[12_345] = 7.0
    return values


def test_a_thinned_curve_keeps_its_ends_and_every_peak():
    y = spiky()
    kept = drawing.envelope(y)
    assert len(kept) < 1_000
    assert {0, 12_345, len(y) - 1} <= set(kept.tolist())
    assert (np.diff(kept) > 0).all()


def test_a_short_curve_is_not_thinned():
    np.testing.assert_array_equal(drawing.envelope(np.arange(50.0)), np.arange(50))


def test_a_thinned_curve_keeps_the_gaps_of_what_was_not_there():
    y = spiky()
    y[4_000:8_000] = np.nan
    kept = drawing.envelope(y)
    assert np.isnan(y[kept[(kept > 4_100) & (kept < 7_900)]]).all()


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


def test_every_resolver_there_is_has_a_colour_of_its_own():
    assert set(palette.COLOURS) == set(solvers.names())
    assert len(set(palette.COLOURS.values())) == len(palette.COLOURS)


def test_a_resolver_has_the_same_colour_in_any_company():
    for label in ("recursive", "hqp osqp", "tpm published"):
        for others in ([], ["hqp proxqp", "something new"], ["tpm", "hqp daqp", "my own"]):
            assert drawing.colours([*others, label])[label] == palette.colour(label)


def test_a_variant_has_the_colour_of_its_resolver_and_a_line_of_its_own():
    looks = palette.looks(["tpm published", "tpm", "hqp osqp", "hqp daqp", "hqp proxqp"])
    assert list(looks) == ["tpm published", "tpm", "hqp osqp", "hqp daqp", "hqp proxqp"]
    assert looks["tpm"] == (palette.COLOURS["tpm"], palette.SOLID)
    assert looks["tpm published"].colour == looks["tpm"].colour
    assert looks["hqp proxqp"].dash == palette.SOLID
    assert len(set(looks.values())) == 5


def test_a_label_and_the_spec_that_asks_for_it_have_one_colour():
    assert palette.colour("hqp:backend=osqp") == palette.colour("hqp osqp")


def test_no_two_that_stand_side_by_side_look_alike():
    labels = ["tpm published", "one", "two", "three", "hqp", "weighted 10", "weighted 20",
              "weighted 30", "ellipse", "human"]
    assert len(set(palette.looks(labels).values())) == len(labels)


def test_shared_limits_leave_out_the_one_run_that_would_flatten_the_others():
    low, high = drawing.shared_limits([(-1.0, 1.0), (-1.2, 1.1), (-80.0, 90.0)])
    assert -2.0 < low < -1.2
    assert 1.1 < high < 2.0


def test_shared_limits_of_constants_are_still_a_range():
    low, high = drawing.shared_limits([(0.0, 0.0), (0.0, 0.0)])
    assert low < 0.0 < high


def test_the_picture_is_seen_without_distortion():
    x, y, z = drawing.project(np.eye(3))
    for axis in (x, y, z):
        assert np.linalg.norm(axis) <= 1.0
    assert drawing.project(np.array([0.0, 0.0, 1.0]))[0] == pytest.approx(0.0)


@pytest.mark.parametrize("panel", panels.PANELS, ids=lambda panel: panel.name)
def test_every_panel_draws_a_run_that_has_its_signal(panel):
    run = recording()
    assert panel.fits(run)
    drawn = beside(panel, {"tpm published": run, "hqp": run})
    assert list(drawn) == ["tpm published", "hqp"]
    assert drawn["hqp"].axes[0].get_ylim() == drawn["tpm published"].axes[0].get_ylim()


@pytest.mark.parametrize("panel", panels.PANELS, ids=lambda panel: panel.name)
def test_a_panel_without_its_signal_is_left_out_and_not_drawn_empty(panel):
    run = recording()
    del run.signals[panel.signal]
    assert beside(panel, {"hqp": run}) == {}


def test_a_run_far_beyond_the_others_is_cut_and_says_so():
    quiet = recording(v=np.eye(5, 7))
    wild = recording(v=1000.0 * np.eye(5, 7))
    velocities = panels.PANELS[0]
    drawn = beside(velocities, {"a": quiet, "b": quiet, "c": wild})
    texts = [text.get_text() for text in drawn["c"].axes[0].texts]
    assert any("cut" in text for text in texts)
    assert drawn["a"].axes[0].get_ylim()[1] < 10.0


def test_the_stretches_in_which_a_task_is_active_are_red():
    run = recording(pointing_active=[False, True, True, False, False],
                    pointing_error=[0.0, 1.0, 2.0, 3.0, 4.0])
    fig = beside(panels.PANEL["pointing-error"], {"hqp": run})["hqp"]
    (red,) = [line for line in fig.axes[0].lines if line.get_color() == drawing.ALERT]
    np.testing.assert_array_equal(red.get_ydata(), [np.nan, 1.0, 2.0, np.nan, np.nan])


def test_all_figures_of_a_run_are_written_as_svg_and_png(tmp_path):
    figures.write_all(recording(), tmp_path)
    stems = {path.stem for path in tmp_path.iterdir()}
    letter = {figure.name for figure in figures.SIMULATION}
    assert stems == letter | {"picture", "stack", "tick-times"}
    assert len(list(tmp_path.iterdir())) == 2 * len(stems)


def test_the_same_figure_is_the_same_file(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        figures.write_all(recording(), tmp_path / name)
    first, second = sorted((tmp_path / "a").glob("*.svg")), sorted((tmp_path / "b").glob("*.svg"))
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]


def test_a_scene_without_obstacles_or_a_path_asked_for_is_still_a_picture():
    run = recording()
    for signal in ("desired_position", "minimal_distance", "control_point_distance"):
        del run.signals[signal]
    assert picture({"hqp": run}).axes


def test_an_inline_svg_follows_the_page_and_brings_no_ids_that_could_clash():
    fig, (ax,) = drawing.figure()
    ax.plot([0.0, 1.0], [0.123456, 1.0])
    text = drawing.svg(fig, 'a "title" & more')
    assert text.startswith('<svg role="img" aria-label="a &quot;title&quot; &amp; more"')
    assert "currentColor" in text
    assert drawing.INK not in text
    assert 'id="figure_1"' not in text
    assert "<metadata" not in text
