"""Pages and figures."""

import itertools

import numpy as np
import pytest
from hand_made import recording
from headless import chromium, whole
from scene import TURN

from hierarchy.avoidance import Measurement, Obstacle
from hierarchy.avoidance.measurement import measure_exactly
from scenarios import load, save, simulate
from scenarios.cell.sensors.sensor import packed_laws
from scenarios.draw.figures import letter, picture
from scenarios.measure.runs import Run
from scenarios.measure.verdict import Comparison
from scenarios.results.page import comparison_page


def test_a_page_in_a_browser_fits_its_window_and_has_no_complaints(tmp_path):
    """Of real runs, two of which are the same motion."""
    short = load("ellipse", ["control.duration=0.3"])
    asked = {of: short.with_resolver(of) for of in ("tpm-published", "recursive", "augmented")}
    runs = [Run(one, spec, spec, simulate(one)) for spec, one in asked.items()]
    text = comparison_page(Comparison(runs, "hierarchy compare hand-made", {"python": "3.11"}))
    (tmp_path / "index.html").write_text(whole(text), encoding="utf-8")
    with chromium() as tab:
        for width, dark in itertools.product((360, 1400), (False, True)):
            tab.look_at((tmp_path / "index.html").as_uri(), width=width, dark=dark)
            assert tab.run("document.documentElement.scrollWidth") <= width
            assert not tab.run("document.querySelector('iframe').srcdoc") or width == 1400
            tab.run("document.querySelector('iframe').scrollIntoView()")
            tab.wait("document.querySelector('iframe').srcdoc.length > 1000")
            tab.wait("document.querySelector('iframe').contentDocument?.readyState === 'complete'")
            tab.run("document.querySelectorAll('details').forEach(one => { one.open = true; })")
            assert tab.run("document.documentElement.scrollWidth") <= width
        tab.run("document.querySelector('.command button').click()")
        tab.wait("/copied|selected/.test(document.querySelector('.command button').textContent)")
        assert tab.complaints == []


def test_figures_drawn_anew_take_the_place_of_those_in_the_run_folder(tmp_path, monkeypatch):
    run_folder = save(recording(), tmp_path / "run")
    for text in ("old", "new"):
        monkeypatch.setattr(letter, "write_all", lambda recording, folder, text=text: [
            (folder / name).write_text(text) for name in ("a.svg", "b.svg")])
        assert letter.redraw([run_folder]) == [run_folder / "a.svg", run_folder / "b.svg"]
    assert (run_folder / "b.svg").read_text() == "new"
    assert (run_folder / "run.npz").exists()
    assert not [path for path in run_folder.iterdir() if path.name.startswith(".")]


@pytest.mark.parametrize("obstacle", [
    Obstacle("point", (0.3, 0.0, 0.2)), Obstacle("sphere", (0.3, 0.0, 0.2), (0.1,)),
    Obstacle("capsule", (0.3, 0.0, 0.2), (0.1, 0.4), TURN),
    Obstacle("box", (0.3, 0.0, 0.2), (0.1, 0.2, 0.3), TURN)], ids=lambda one: one.shape)
def test_an_obstacle_is_drawn_as_far_as_distances_say_that_it_reaches(obstacle):
    balls, radius = picture.hull(obstacle)
    for direction in np.random.default_rng(1).normal(size=(20, 3)):
        u, far = direction / np.linalg.norm(direction), 1e5
        seen, there = Measurement(0), np.r_[np.eye(3).ravel(), obstacle.centre + far * u][None]
        measure_exactly(there, np.zeros(1, int), np.zeros((1, 3)), obstacle.packed()[None],
                        packed_laws(), np.zeros(2), seen.arrays)
        assert (balls @ u).max() + radius == pytest.approx(far - seen.distance[0], abs=1e-5)
