import numpy as np
import pytest
from hand_made import recording

from scenarios import drawing, figures
from scenarios.picture import picture


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


def test_a_resolver_has_the_same_colour_in_any_company():
    alone = drawing.colours(["recursive"])["recursive"]
    assert drawing.colours(["hqp", "something new", "recursive"])["recursive"] == alone


def test_a_variant_has_the_colour_of_its_resolver_unless_that_is_there_too():
    assert drawing.colours(["hqp proxqp"])["hqp proxqp"] == drawing.colours(["hqp"])["hqp"]
    both = drawing.colours(["hqp proxqp", "hqp"])
    assert list(both) == ["hqp proxqp", "hqp"]
    assert both["hqp"] == drawing.colours(["hqp"])["hqp"] != both["hqp proxqp"]


def test_no_two_resolvers_of_a_comparison_share_a_colour():
    labels = ["tpm published", "one", "two", "three", "hqp", "recursive"]
    assert len(set(drawing.colours(labels).values())) == len(labels)


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


@pytest.mark.parametrize("panel", figures.PANELS, ids=lambda panel: panel.name)
def test_every_panel_draws_a_run_that_has_its_signal(panel):
    run = recording()
    assert panel.fits(run)
    drawn = figures.side_by_side(panel, {"tpm published": run, "hqp": run})
    assert list(drawn) == ["tpm published", "hqp"]
    assert drawn["hqp"].axes[0].get_ylim() == drawn["tpm published"].axes[0].get_ylim()


@pytest.mark.parametrize("panel", figures.PANELS, ids=lambda panel: panel.name)
def test_a_panel_without_its_signal_is_left_out_and_not_drawn_empty(panel):
    run = recording()
    del run.signals[panel.signal]
    assert figures.side_by_side(panel, {"hqp": run}) == {}


def test_a_run_far_beyond_the_others_is_cut_and_says_so():
    quiet = recording(v=np.eye(5, 7))
    wild = recording(v=1000.0 * np.eye(5, 7))
    velocities = figures.PANELS[0]
    drawn = figures.side_by_side(velocities, {"a": quiet, "b": quiet, "c": wild})
    texts = [text.get_text() for text in drawn["c"].axes[0].texts]
    assert any("cut" in text for text in texts)
    assert drawn["a"].axes[0].get_ylim()[1] < 10.0


def test_the_stretches_in_which_a_task_is_active_are_red():
    run = recording(pointing_active=[False, True, True, False, False],
                    pointing_error=[0.0, 1.0, 2.0, 3.0, 4.0])
    fig = figures.side_by_side(figures._PANEL["pointing-error"], {"hqp": run})["hqp"]
    (red,) = [line for line in fig.axes[0].lines if line.get_color() == drawing.ALERT]
    np.testing.assert_array_equal(red.get_ydata(), [np.nan, 1.0, 2.0, np.nan, np.nan])


def test_all_figures_of_a_run_are_written_as_svg_and_png(tmp_path):
    figures.write_all(recording(), tmp_path)
    stems = {path.stem for path in tmp_path.iterdir()}
    assert stems == {figure.name for figure in figures.SIMULATION} | {"picture", "tick-times"}
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
